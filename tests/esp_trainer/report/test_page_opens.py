"""How a page opens: a chase that moves, links to a moment, the tour and the glossary."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

OpenPage = Callable[..., Any]

STATE = """() => {
  const { predators, prey, start, time, playing } = predprey.player;
  return { predators: predators.generation, prey: prey.generation, start, time, playing };
}"""


@pytest.mark.slow
def test_on_opening_a_chase_moves_below_the_verdict_and_its_buttons_are_seen(
    page_file: Path, open_page: OpenPage
) -> None:
    tab = open_page(page_file, reduced_motion="no-preference")
    tab.until("predprey.player.time > 1")
    toggle, verdict = (tab.page.locator(name).bounding_box() for name in ("#toggle", "#verdict"))
    assert verdict["y"] + verdict["height"] < toggle["y"]
    assert toggle["y"] + toggle["height"] <= 900
    tab.assert_quiet()


@pytest.mark.slow
def test_for_readers_who_want_little_motion_it_stands_still(page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file)
    tab.page.wait_for_timeout(300)
    assert (tab(STATE)["time"], tab(STATE)["playing"]) == (0, False)


@pytest.mark.slow
def test_figures_of_the_story_open_on_demand(page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file)
    figures = tab.page.locator("#story li details").first
    assert not figures.is_visible()
    tab.page.locator("#story > details > summary").click()
    assert "from early to late" not in tab.page.locator("#story").inner_text()
    figures.locator("summary").click()
    assert "from early to late" in tab.page.locator("#story").inner_text()
