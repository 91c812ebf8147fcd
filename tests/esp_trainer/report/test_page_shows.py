"""What a network wants."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

OpenPage = Callable[..., Any]


@pytest.mark.slow
def test_the_picture_shows_what_would_be_voted_for_elsewhere(page_file: Path, open_page: OpenPage) -> None:
    """The votes for an offset are those of a match that starts there."""
    tab = open_page(page_file)
    found = tab("""() => {
      const { player } = predprey, { game, match } = player, votes = ({ votes }) => [...votes];
      const offsets = [[3, -2], [0, 0], [-11, 7]];
      const wanted = game.thoughtsIf(match, 0, 0, 4, offsets).map(votes);
      const moved = offsets.map(([dx, dy]) => {
        const start = match.start.map((cell) => [...cell]), [x, y] = start[0];
        start[4] = [(x + dx + 24) % 24, (y + dy + 24) % 24];
        return votes(game.thoughts(game.match(match.predators, match.prey, start), 0, 0));
      });
      return [wanted, moved, votes(game.thoughts(match, 0, 0))];
    }""")
    assert found[0] == found[1]
    assert found[0][0] != found[2]


@pytest.mark.slow
def test_it_follows_the_mouse_the_focus_and_the_choice(page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file)
    picture, says = tab.page.locator(".wants canvas"), tab.page.locator(".wants figcaption")
    picture.scroll_into_view_if_needed()
    tab.until("document.querySelector('.wants figcaption').textContent.startsWith('What network 1 of predator 0')")
    pixels = "() => document.querySelector('.wants canvas').toDataURL()"
    first = tab(pixels)
    rows = tab.page.locator("#thoughts [data-network]")
    rows.nth(1).hover()
    assert says.inner_text().startswith("What network 2 of predator 0 would vote for, by where prey b stands")
    assert tab(pixels) != first
    rows.nth(2).hover()
    assert says.inner_text().startswith("What all networks of predator 0 together would vote for")
    tab.page.locator("#thoughts h3").hover()
    assert says.inner_text().startswith("What network 1 of predator 0")
    assert tab(pixels) == first
    tab.page.locator("#thoughts [aria-pressed]", has_text="prey a").hover()
    assert says.inner_text().startswith("What network 1 of prey a would vote for, by where predator 0 stands")
    tab.page.locator("#thoughts h3").hover()
    rows.nth(1).locator("button").focus()
    tab.page.keyboard.press("Enter")
    tab.page.locator("#theme").focus()
    assert says.inner_text().startswith("What network 2 of predator 0")
    assert picture.get_attribute("aria-label") == says.inner_text()
    tab.assert_quiet()


@pytest.mark.slow
def test_the_votes_fit_a_phone(page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file, viewport={"width": 360, "height": 740}, has_touch=True, is_mobile=True)
    table = tab.page.locator("#thoughts table").bounding_box()
    assert table["x"] + table["width"] <= 360
    assert tab("() => ((votes) => votes.scrollWidth - votes.clientWidth)(document.querySelector('.votes'))") == 0
