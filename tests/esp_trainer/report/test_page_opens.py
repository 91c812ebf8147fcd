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
    assert not tab.page.locator("#tour").is_visible()
    tab.assert_quiet()


@pytest.mark.slow
def test_the_first_chase_plays_again_but_not_once_it_is_stopped(page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file, reduced_motion="no-preference")
    tab.until("predprey.player.time > 1")
    tab("() => { predprey.player.time = predprey.player.match.length; }")
    tab.until("predprey.player.time === predprey.player.match.length && predprey.player.playing")
    tab.until("predprey.player.time < predprey.player.match.length")
    tab("() => { predprey.player.time = predprey.player.match.length; }")
    tab.page.locator("#toggle").click()
    tab.page.wait_for_timeout(2000)
    assert tab("() => predprey.player.time === predprey.player.match.length && !predprey.player.playing")


@pytest.mark.slow
def test_for_readers_who_want_little_motion_it_stands_still(page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file)
    tab.page.wait_for_timeout(300)
    assert (tab(STATE)["time"], tab(STATE)["playing"]) == (0, False)


@pytest.mark.slow
def test_beside_the_result_stands_that_of_all_starts(page_file: Path, open_page: OpenPage, data_of: Any) -> None:
    data = data_of(page_file)
    matrix, result = data["matrix"], "() => document.getElementById('result').textContent"
    tab = open_page(page_file)
    assert tab(result).endswith(f"From all 8 starts {matrix['matrices'][0][-1][-1]:.2f} of the prey are caught.")
    tab("() => predprey.player.show({ predators: { run: 0, generation: 0 } })")
    assert tab(result).endswith(f"From all 8 starts {matrix['matrices'][0][0][-1]:.2f} of the prey are caught.")
    assert 1 not in matrix["predators"]
    tab("() => predprey.player.show({ predators: { run: 0, generation: 1 } })")
    assert "From all" not in tab(result)


@pytest.mark.slow
def test_figures_of_the_story_open_on_demand(page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file)
    figures = tab.page.locator("#story li details").first
    assert not figures.is_visible()
    tab.page.locator("#story > details > summary").click()
    assert "from early to late" not in tab.page.locator("#story").inner_text()
    figures.locator("summary").click()
    assert "from early to late" in tab.page.locator("#story").inner_text()


@pytest.mark.slow
def test_a_link_leads_to_its_moment(page_file: Path, open_page: OpenPage, data_of: Any) -> None:
    tab = open_page(page_file, "#p=5&q=17&start=4&step=6", reduced_motion="no-preference")
    assert tab(STATE) == {"predators": 5, "prey": 17, "start": 3, "time": 6, "playing": False}
    assert tab.page.locator("#start-name").inner_text() == "4 of 8"
    tab("() => { location.hash = '#p=23&q=2&start=1&step=0'; }")
    tab.until("predprey.player.prey.generation === 2")
    assert tab(STATE) == {"predators": 23, "prey": 2, "start": 0, "time": 0, "playing": False}
    tab.assert_quiet()


@pytest.mark.slow
def test_a_button_writes_the_link_that_leads_back(page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file)
    moment = "{ predators: { run: 0, generation: 7 }, prey: { run: 0, generation: 9 }, start: 2, step: 3 }"
    tab(f"() => predprey.player.show({moment})")
    tab.page.locator("#link").click()
    tab.until("document.getElementById('linked').textContent !== ''")
    assert tab("() => location.hash") == "#p=7&q=9&start=3&step=3"
    own = [[1, 2], [3, 4], [5, 6], [7, 8], [9, 10]]
    tab("(start) => predprey.player.show({ start })", own)
    tab.page.locator("#link").click()
    link = tab("() => location.hash")
    assert link == "#p=7&q=9&start=1,2,3,4,5,6,7,8,9,10&step=0"
    again = open_page(page_file, link)
    assert again(STATE) == {"predators": 7, "prey": 9, "start": own, "time": 0, "playing": False}
    tab.assert_quiet()


@pytest.mark.slow
def test_a_link_names_the_runs_where_there_are_several(pages_file: Path, open_page: OpenPage) -> None:
    tab = open_page(pages_file, "#p=5&pr=1&q=6&qr=0&start=1&step=2")
    assert tab("() => [predprey.player.predators.run, predprey.player.prey.run]") == [1, 0]
    tab.page.locator("#link").click()
    assert tab("() => location.hash") == "#p=5&pr=1&q=6&qr=0&start=1&step=2"


@pytest.mark.slow
@pytest.mark.parametrize(
    "link",
    [
        "#start=9&step=0",  # there are 8
        "#start=0",
        "#start=1,2,3&p=x&q=-1",
        "#start=1,2,3,4,5,6,7,8,9,24&step=1e9",  # the world has 24 cells
        "#step=<b>",
        "#pr=7&qr=one&p=2.5",
    ],
)
def test_what_a_link_says_in_vain_is_left_out(link: str, page_file: Path, open_page: OpenPage) -> None:
    usual = open_page(page_file)(STATE)
    tab = open_page(page_file, link)
    assert tab(STATE) == usual
    tab.assert_quiet()


@pytest.mark.slow
@pytest.mark.parametrize("size", [(1280, 900), (360, 740)])
def test_the_tour_points_at_each_part_and_leaves(size: tuple[int, int], page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file, viewport=dict(zip(("width", "height"), size, strict=True)))
    tour, keyboard = tab.page.locator("#tour"), tab.page.keyboard
    tab.page.locator("#take-tour").click()
    seen = []
    while tour.is_visible():
        pointed = tab.page.locator(".pointed")
        assert 0 <= pointed.bounding_box()["y"] < size[1] / 2, seen  # above the tour's box
        seen.append(pointed.evaluate("(place) => place.id || place.className"))
        keyboard.press("Enter")  # on the button "Next", which has the focus
    assert [name.split()[0] for name in seen] == [
        "verdict",
        "stage",
        "predators",
        "matrix-figure",
        "yourself",
        "thoughts",
    ]
    assert tab.page.locator(".pointed").count() == 0
    assert tab("() => document.activeElement.id") == "take-tour"
    tab.assert_quiet()


@pytest.mark.slow
def test_the_tour_goes_back_and_can_be_skipped(page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file)
    tour = tab.page.locator("#tour")
    tab.page.locator("#take-tour").click()
    assert not tour.locator("button", has_text="Back").is_visible()
    tour.locator("button", has_text="Next").click()
    assert tour.locator("h2").inner_text() == "2 of 6: A chase"
    tour.locator("button", has_text="Back").click()
    assert tour.locator("h2").inner_text() == "1 of 6: What happened"
    tab.page.keyboard.press("Escape")
    assert not tour.is_visible()
    tab.page.locator("#take-tour").click()
    tour.locator("button", has_text="Skip").click()
    assert not tour.is_visible()


@pytest.mark.slow
def test_the_glossary_opens(page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file)
    assert not tab.page.locator("#glossary dl").is_visible()
    tab.page.locator("#glossary summary").click()
    assert "What leaves it on one side comes back" in tab.page.locator("#glossary").inner_text()
