"""The page in a browser without a network: looked at, clicked, dragged, typed at."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from esp_trainer import Team
from esp_trainer.run.directory import RunDirectory
from predprey_env import EnvConfig, PredPreyEnv

OpenPage = Callable[..., Any]
PlayedByEnvironment = Callable[[Path, int, int, list[list[int]]], list[list[list[int]]]]

STATE = """() => {
  const { player } = predprey;
  return { predators: player.predators.generation, prey: player.prey.generation, start: player.start, time: player.time,
    playing: player.playing, length: player.match.length, cells: player.match.cells };
}"""


def test_a_page_opens_offline_in_a_moment_and_complains_of_nothing(page_file: Path, open_page: OpenPage) -> None:
    begun = time.perf_counter()
    tab = open_page(page_file, near=True)
    assert time.perf_counter() - begun < 10  # a hang, not a measurement: that is in docs/report.md
    tab.draw_charts()
    assert page_file.stat().st_size < 10e6
    assert tab.page.locator("h1").inner_text() == "seed0"
    assert tab.page.locator("#story ol li").count() >= 4
    assert tab.page.locator(".charts figure").count() == 7
    tab.assert_quiet()


def test_the_player_shows_what_the_environment_plays(
    runs: list[Path], page_file: Path, open_page: OpenPage, data_of: Any, played_by_environment: PlayedByEnvironment
) -> None:
    starts = data_of(page_file)["starts"]
    tab = open_page(page_file)
    for predators, prey, start in ((23, 23, 0), (5, 17, 3), (0, 23, 7)):
        tab(
            "([p, q, start]) => predprey.player.show({ predators: { run: 0, generation: p },"
            " prey: { run: 0, generation: q }, start })",
            [predators, prey, start],
        )
        shown = tab(STATE)
        assert (shown["predators"], shown["prey"]) == (predators, prey)
        assert shown["cells"] == played_by_environment(runs[0], predators, prey, starts[start])
    tab.assert_quiet()


@pytest.mark.slow
def test_sliders_choose_generations_and_starts(
    runs: list[Path], page_file: Path, open_page: OpenPage, data_of: Any, played_by_environment: PlayedByEnvironment
) -> None:
    tab = open_page(page_file)
    assert tab(STATE)["predators"] == tab(STATE)["prey"] == 23
    for slider, key, presses in (("#predators", "ArrowLeft", 3), ("#prey", "Home", 1), ("#start", "End", 1)):
        tab.page.locator(slider).focus()
        for _ in range(presses):
            tab.page.keyboard.press(key)
    shown = tab(STATE)
    assert (shown["predators"], shown["prey"], shown["start"]) == (20, 0, 7)
    assert tab.page.locator("#predators-generation").inner_text() == "20"
    assert tab.page.locator("#start-name").inner_text() == "8 of 8"
    assert shown["cells"] == played_by_environment(runs[0], 20, 0, data_of(page_file)["starts"][7])
    tab.assert_quiet()


@pytest.mark.slow
def test_it_plays_pauses_steps_and_seeks(page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file)
    page = tab.page
    page.locator("#forward").click()
    page.locator("#forward").click()
    page.locator("#back").click()
    assert tab(STATE)["time"] == 1
    assert page.locator("#clock").inner_text().startswith("1 / ")
    page.locator("#speed").select_option("0.5")  # so that it still plays when it is asked, on a busy machine too
    page.locator("#toggle").click()
    tab.until("predprey.player.time > 3")
    assert tab(STATE)["playing"]
    page.locator("#toggle").click()
    assert not tab(STATE)["playing"]
    page.locator("#scrub").fill("10")
    assert tab(STATE)["time"] == 10
    page.locator("#speed").select_option("8")
    page.locator("#toggle").click()
    tab.until("!predprey.player.playing")  # it stops by itself at the end
    assert tab(STATE)["time"] == tab(STATE)["length"]
    tab.assert_quiet()


@pytest.mark.slow
def test_keys_do_the_same(page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file)
    keyboard = tab.page.keyboard
    tab.page.locator("#world").focus()
    assert tab(STATE)["time"] == 0
    for key, expected in (("End", "length"), ("Home", 0), ("ArrowRight", 1), ("ArrowRight", 2), ("ArrowLeft", 1)):
        keyboard.press(key)
        shown = tab(STATE)
        assert shown["time"] == (shown["length"] if expected == "length" else expected)
    keyboard.press(" ")
    assert tab(STATE)["playing"]
    keyboard.press(" ")
    assert not tab(STATE)["playing"]


@pytest.mark.slow
def test_keys_work_from_the_first_moment_and_do_not_scroll(page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file, viewport={"width": 1280, "height": 1200})
    keyboard, scrolled = tab.page.keyboard, "() => window.scrollY"
    tab("() => { predprey.player.speed = 0.01; }")  # lest the match ends meanwhile
    keyboard.press("ArrowRight")
    keyboard.press("ArrowRight")
    keyboard.press("ArrowLeft")
    assert (tab(STATE)["time"], tab(STATE)["playing"]) == (1, False)
    keyboard.press(" ")
    assert tab(STATE)["playing"]
    tab.page.locator("#result").click()  # on a text, which needs no keys
    before = tab(scrolled)
    keyboard.press(" ")
    assert not tab(STATE)["playing"]
    keyboard.down(" ")
    keyboard.down(" ")  # held down, it counts once
    keyboard.up(" ")
    assert tab(STATE)["playing"]
    assert tab(scrolled) == before
    tab.assert_quiet()


@pytest.mark.slow
def test_where_the_player_is_not_seen_space_scrolls_the_page(page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file, viewport={"width": 1280, "height": 500})
    tab.page.locator("#world").click(position={"x": 1, "y": 1})  # it has the focus
    tab("() => document.querySelector('#charts').scrollIntoView({ behavior: 'instant' })")
    before = tab("() => window.scrollY")
    tab.page.keyboard.press(" ")
    tab.until(f"window.scrollY > {before}")
    assert not tab(STATE)["playing"]
    tab("() => window.scrollTo({ top: document.body.scrollHeight, behavior: 'instant' })")
    tab.page.keyboard.press(" ")
    tab.page.keyboard.press("ArrowRight")
    assert (tab(STATE)["playing"], tab(STATE)["time"]) == (False, 0)
    tab.assert_quiet()


@pytest.mark.slow
def test_after_a_click_on_a_moment_space_is_the_players(page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file)
    tab("() => { predprey.player.speed = 0.01; }")
    tab.page.locator(".moments button").last.click()
    assert tab(STATE)["playing"]
    tab.page.keyboard.press(" ")
    assert not tab(STATE)["playing"]
    tab.page.keyboard.press(" ")
    assert tab(STATE)["playing"]
    tab.assert_quiet()


@pytest.mark.slow
def test_keys_of_the_browser_are_left_to_it(page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file)
    tab("() => addEventListener('keydown', (event) => { window.left = !event.defaultPrevented; })")
    for keys in ("Control+ArrowRight", "Alt+ArrowRight", "Meta+ArrowRight", "Shift+Space", "End"):
        tab("() => { window.left = undefined; }")
        tab.page.keyboard.press(keys)
        assert (tab("() => left"), tab(STATE)["time"], tab(STATE)["playing"]) == (True, 0, False), keys


@pytest.mark.slow
def test_what_has_the_focus_keeps_the_keys_that_it_needs(page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file)
    keyboard = tab.page.keyboard
    tab.page.locator("#forward").click()
    keyboard.press("ArrowRight")
    assert tab(STATE)["time"] == 2
    keyboard.press(" ")  # presses the button
    assert (tab(STATE)["time"], tab(STATE)["playing"]) == (3, False)
    tab.page.locator("#theme").focus()
    keyboard.press(" ")
    assert not tab(STATE)["playing"]
    tab.page.locator("#speed").focus()
    keyboard.press("ArrowRight")
    assert (tab(STATE)["time"], tab("() => predprey.player.speed")) == (3, 2)
    tab.page.locator("#scrub").focus()
    keyboard.press("ArrowRight")
    keyboard.press("ArrowRight")
    assert tab(STATE)["time"] == 5
    keyboard.press(" ")  # which a slider does not need
    assert tab(STATE)["playing"]
    tab.assert_quiet()


@pytest.mark.slow
def test_agents_can_be_asked_while_they_play(page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file)
    tab.page.locator("#toggle").click()
    for name in ("prey a", "predator 2", "prey b"):
        tab.page.locator("#thoughts [aria-pressed]", has_text=name).click(delay=90)
        assert tab.page.locator("#thoughts [aria-pressed=true]").inner_text() == name
    tab.assert_quiet()


@pytest.mark.slow
def test_from_a_start_of_ones_own_the_slider_leads_back(page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file)
    tab("() => predprey.player.show({ start: 0 })")
    tab("() => predprey.player.show({ start: predprey.player.match.cells[4] })")
    assert tab.page.locator("#start-name").inner_text() == "your own"
    tab.page.locator("#start").focus()
    tab.page.keyboard.press("Home")
    assert tab(STATE)["start"] == 0
    assert tab.page.locator("#start-name").inner_text() == "1 of 8"


@pytest.mark.slow
def test_a_click_on_a_cell_of_the_matrix_plays_that_match(page_file: Path, open_page: OpenPage, data_of: Any) -> None:
    matrix = data_of(page_file)["matrix"]
    tab = open_page(page_file, near=True)
    cells = tab.page.locator("#matrix .nsewdrag")
    cells.scroll_into_view_if_needed()
    width, height = cells.bounding_box()["width"], cells.bounding_box()["height"]
    axes = tab("() => ['xaxis', 'yaxis'].map((axis) => document.getElementById('matrix')._fullLayout[axis].range)")
    for row, column in ((1, 5), (0, 0), (0, -1), (-1, 0), (-1, -1)):
        tab("() => predprey.player.pause()")
        x, y = matrix["prey"][column], matrix["predators"][row]
        across = (x - axes[0][0]) / (axes[0][1] - axes[0][0])
        up = (y - axes[1][0]) / (axes[1][1] - axes[1][0])
        place = {"x": across * width, "y": (1 - up) * height}
        cells.hover(position=place)
        label = tab.page.locator("#matrix .hoverlayer .hovertext", has_text=f"predators of generation {y}")
        label.filter(has_text=f"{matrix['matrices'][0][row][column]:.2f} of the prey caught").wait_for()
        cells.click(position=place)
        tab.until("predprey.player.playing")
        shown = tab(STATE)
        assert (shown["predators"], shown["prey"]) == (y, x)
    tab.assert_quiet()


@pytest.mark.slow
def test_charts_have_no_bar_of_buttons(page_file: Path, open_page: OpenPage) -> None:
    """It would cover what can be clicked, and offer to upload the chart."""
    tab = open_page(page_file, near=True)
    tab.page.locator("#matrix").hover()
    charts = tab.page.locator(".charts figure > div, #matrix")
    assert charts.count() == 8
    for i in range(charts.count()):
        charts.nth(i).hover()
    assert tab.page.locator(".modebar, .modebar-container button, .plotlyjsicon").count() == 0
    tab.assert_quiet()


@pytest.mark.slow
def test_a_moment_plays_where_its_behaviour_is_marked(page_file: Path, open_page: OpenPage, data_of: Any) -> None:
    moments = data_of(page_file)["moments"]
    assert moments
    tab = open_page(page_file)
    buttons = tab.page.locator(".moments button")
    assert buttons.count() == len(moments)
    for i, moment in enumerate(moments):
        buttons.nth(i).click()
        shown = tab(STATE)
        assert shown["predators"] == shown["prey"] == moment["generation"]
        assert shown["start"] == moment["start"]
        found = tab("() => predprey.player.scene.found")[moment["behaviour"]]
        assert [moment["step"], moment["until"]] in found
    tab.assert_quiet()


@pytest.mark.slow
def test_what_is_seen_stands_on_the_time_line_and_a_click_goes_there(page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file)
    tab.page.locator(".moments button").first.click()
    tab("() => predprey.player.pause()")
    found = tab("() => predprey.player.scene.found")
    names = tab.page.locator("#timeline .row span").all_inner_texts()
    assert set(names) - {"capture"} == set(found)
    tab.page.locator("#timeline .track").last.click()  # in its middle
    assert tab(STATE)["time"] == pytest.approx(tab(STATE)["length"] / 2, abs=1)


@pytest.mark.slow
def test_an_agent_that_is_dragged_starts_another_chase(
    runs: list[Path], page_file: Path, open_page: OpenPage, played_by_environment: PlayedByEnvironment
) -> None:
    tab = open_page(page_file)
    before = tab(STATE)
    size = RunDirectory(runs[0]).read_config().env.size
    box = tab.page.locator("#world").bounding_box()

    def place(cell: list[int]) -> tuple[float, float]:
        x, y = ((part + 0.5) / size for part in cell)
        return box["x"] + x * box["width"], box["y"] + (1 - y) * box["height"]

    target = [(before["cells"][0][3][0] + 7) % size, (before["cells"][0][3][1] + 5) % size]
    tab.page.mouse.move(*place(before["cells"][0][3]))
    tab.page.mouse.down()
    tab.page.mouse.move(*place(target), steps=4)
    tab.page.mouse.up()
    shown = tab(STATE)
    start = [target if agent == 3 else cell for agent, cell in enumerate(before["cells"][0])]
    assert shown["start"] == start
    assert tab.page.locator("#start-name").inner_text() == "your own"
    assert shown["cells"] == played_by_environment(runs[0], shown["predators"], shown["prey"], start)
    tab.assert_quiet()


@pytest.mark.slow
def test_a_click_on_an_agent_asks_why_it_moved(page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file)
    tab.page.locator("#thoughts [aria-pressed]", has_text="prey b").click()
    assert "Step 0: prey b goes" in tab.page.locator("#thoughts caption").inner_text()
    assert tab.page.locator("#thoughts tbody tr").count() == 3  # a network for each predator
    assert tab.page.locator("#thoughts tfoot td").count() == 4
    moves = ["east", "west", "north", "south"]
    before, after = tab("() => predprey.player.match.cells.slice(0, 2).map((cells) => cells[4])")
    way = [(b - a + 12) % 24 - 12 for a, b in zip(before, after, strict=True)]
    went = moves[[[1, 0], [-1, 0], [0, 1], [0, -1]].index(way)]
    assert tab.page.locator("#thoughts caption").inner_text().startswith(f"Step 0: prey b goes {went}")
    assert tab.page.locator("#thoughts thead .chosen").inner_text() == went


@pytest.mark.slow
def test_it_has_a_dark_side(page_file: Path, open_page: OpenPage) -> None:
    ground = "() => getComputedStyle(document.body).backgroundColor"
    light, dark = (open_page(page_file, color_scheme=scheme) for scheme in ("light", "dark"))
    grounds = [tab(ground) for tab in (light, dark)]
    assert grounds[0] != grounds[1]
    light.page.locator("#theme").click()
    assert light(ground) == grounds[1]
    text = "() => getComputedStyle(document.querySelector('.charts .legendtext')).fill"
    for tab in (light, dark):
        tab.draw_charts()
    assert light(text) == dark(text)
    light.assert_quiet()


@pytest.mark.slow
def test_it_fits_a_phone(page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file, viewport={"width": 360, "height": 740}, has_touch=True, is_mobile=True)
    tab.draw_charts()
    assert tab("() => document.documentElement.scrollWidth") <= 360
    world = tab.page.locator("#world").bounding_box()
    assert world["width"] > 300
    tab.page.locator("#toggle").tap()
    assert tab(STATE)["playing"]
    tab.assert_quiet()


@pytest.mark.slow
def test_predators_of_one_run_meet_prey_of_another(
    runs: list[Path], pages_file: Path, open_page: OpenPage, data_of: Any
) -> None:
    tab = open_page(pages_file, near=True)
    assert tab.page.locator("h1").inner_text() == "seed0 and 1 more"
    assert "of other seeds" in tab.page.locator("#story").text_content()
    tab.page.locator("#prey-run").select_option("1")
    shown = tab(STATE)
    start = data_of(pages_file)["starts"][shown["start"]]
    ours, theirs = RunDirectory(runs[0]), RunDirectory(runs[1])
    hunters = Team.load(ours.champion_file("predators", 23))
    hunted = Team.load(theirs.champion_file("prey", 23))
    env = PredPreyEnv(EnvConfig.from_dict(hunters.provenance["env"]))
    observations, _ = env.reset(options={"starts": start})
    steps = 0
    while env.agents:
        observations, *_ = env.step(hunters.act(observations) | hunted.act(observations))
        steps += 1
    n, state = env.config.n_agents, env.state().astype(int)
    assert shown["length"] == steps
    assert shown["cells"][-1] == np.stack([state[:n], state[n : 2 * n]], axis=1).tolist()
    matrix = tab("() => document.getElementById('matrix').data[0].z")
    assert tab("() => document.getElementById('matrix').data[2].x") == []  # it is in no run's matrix
    tab.page.locator("#matrix-run").select_option("1")
    assert tab("() => document.getElementById('matrix').data[0].z") != matrix
    tab.assert_quiet()


@pytest.mark.slow
def test_names_are_shown_as_they_are_and_do_nothing(
    runs: list[Path], tmp_path: Path, report: Callable[..., int], open_page: OpenPage
) -> None:
    name = '<script>alert(1)<⁄script><b>bold<⁄b>&amp; "quotes"'
    places = [shutil.copytree(run, tmp_path / f"{name}{i}") for i, run in enumerate(runs)]
    assert report(*places, "--out", tmp_path / "page.html") == 0
    tab = open_page(tmp_path / "page.html")
    dialogs: list[str] = []
    tab.page.on("dialog", lambda dialog: dialogs.append(dialog.message))
    assert tab.page.locator("h1").inner_text() == f"{name}0 and 1 more"
    assert tab.page.locator("#predators-run option").all_text_contents() == [f"{name}0", f"{name}1"]
    assert tab.page.title() == f"{name}0 and 1 more"
    assert tab.page.locator("main b:not(#timeline b)").count() == 0
    assert dialogs == []
    tab.assert_quiet()
