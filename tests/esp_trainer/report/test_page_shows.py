"""What a network wants, and downloads of what charts show."""

from __future__ import annotations

import csv
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
def test_what_is_drawn_when_it_is_seen_moves_nothing_below(page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file, near=True)
    place = "() => document.querySelector('#moments').getBoundingClientRect().top + scrollY"
    before = tab(place)
    tab.page.locator(".wants canvas").scroll_into_view_if_needed()
    tab.until("document.querySelector('.wants figcaption').textContent.length > 0")
    assert tab(place) == before


@pytest.mark.slow
def test_it_follows_the_mouse_the_focus_and_the_choice(page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file, near=True)
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


def rows_of(tab: Any, button: str, tmp_path: Path) -> list[list[str]]:
    with tab.page.expect_download() as waiting:
        tab.page.locator(button).click()
    place = tmp_path / waiting.value.suggested_filename
    waiting.value.save_as(place)
    with place.open(newline="") as file:
        return list(csv.reader(file))


@pytest.mark.slow
def test_charts_can_be_downloaded(page_file: Path, open_page: OpenPage, data_of: Any, tmp_path: Path) -> None:
    data = data_of(page_file)
    tab = open_page(page_file)
    head, *rows = rows_of(tab, "#chart-master .csv", tmp_path)
    (chart,) = [chart for chart in data["charts"] if chart["id"] == "master"]
    assert head == ["generation", "predators: prey caught", "prey: not caught"]
    hunts, hides = (trace["y"] for trace in chart["data"])
    assert [[float(cell) for cell in row] for row in rows] == [
        list(row) for row in zip(chart["data"][0]["x"], hunts, hides, strict=True)
    ]
    assert tab.page.locator(".charts figure").count() == tab.page.locator(".charts .csv").count()
    head, *rows = rows_of(tab, "#matrix-figure .csv", tmp_path)
    assert head == ["predators of generation", "prey of generation", "prey caught"]
    matrix = data["matrix"]
    assert len(rows) == len(matrix["predators"]) * len(matrix["prey"])
    assert [float(cell) for cell in rows[1]] == [
        matrix["predators"][0],
        matrix["prey"][1],
        matrix["matrices"][0][0][1],
    ]
    tab.assert_quiet()


@pytest.mark.slow
def test_bands_of_intervals_become_columns_and_commas_are_quoted(page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file)
    text = tab("""() => {
      const line = { x: [0, 10], y: [0.2, null], name: "a, b" };
      const band = { x: [0, 10, 10, 0], y: [0.3, 0.5, 0.1, 0.0], fill: "toself", legendgroup: "a, b" };
      return predprey.csvOfChart({ data: [band, line] });
    }""")
    assert text == 'generation,"a, b, high","a, b, low","a, b"\n0,0.3,0,0.2\n10,0.5,0.1,\n'


@pytest.mark.slow
def test_curves_are_compared_over_the_same_generations(page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file)
    tab.draw_charts()
    ranges = tab(
        "() => [...document.querySelectorAll('.charts .js-plotly-plot')].map((chart) => chart.layout.xaxis.range)"
    )
    assert ranges == [[0, 23]] * 7
    shares = tab(
        "() => ['success', 'master'].map((id) => document.querySelector(`#chart-${id} > div`).layout.yaxis.range)"
    )
    assert shares == [[0, 1], [0, 1]]


@pytest.mark.slow
def test_charts_are_drawn_when_they_come_near_and_for_a_print(page_file: Path, open_page: OpenPage) -> None:
    """To draw all as the page opens takes half a second, and to start Plotly another one."""
    assert not open_page(page_file)("() => 'Plotly' in window")
    tab, places = open_page(page_file, near=True), ".charts figure > div, #matrix"
    count = f"[...document.querySelectorAll('{places}')].filter((place) => place.data).length"
    tab.until(f"{count} > 0")
    assert tab(f"() => {count}") < 8
    last = tab.page.locator(places).last
    height = last.bounding_box()["height"]
    last.scroll_into_view_if_needed()
    tab.until("[...document.querySelectorAll('.charts figure > div')].at(-1).data")
    assert last.bounding_box()["height"] == height, "nothing moves"
    again = open_page(page_file, near=True)
    again.page.pdf()
    assert again(f"() => {count}") == 8
    tab.assert_quiet()


@pytest.mark.slow
@pytest.mark.parametrize("width", [1280, 360])
def test_legends_do_not_lie_on_curves(width: int, page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file, viewport={"width": width, "height": 800})
    tab.draw_charts()
    overlaps = tab("""() => [...document.querySelectorAll('.charts .js-plotly-plot')].map((chart) => {
      const legend = chart.querySelector(".legend"), plot = chart.querySelector(".nsewdrag");
      return legend ? legend.getBoundingClientRect().bottom - plot.getBoundingClientRect().top : 0;
    })""")
    assert max(overlaps) <= 1, overlaps
