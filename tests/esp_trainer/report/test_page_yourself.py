"""A person plays on the page, against the evolved others."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from esp_trainer import Team
from esp_trainer.run.directory import RunDirectory
from predprey_env import PredPreyEnv

OpenPage = Callable[..., Any]
N_PREDATORS, N_AGENTS, IDLE = 3, 5, 4

STEERED = """([start, agent, actions]) => {
  const { player, Episode } = predprey, teams = ["predators", "prey"].map((side) => player.team(side, player[side]));
  const episode = new predprey.Episode(player.game, ...teams, start, agent);
  while (!episode.over) episode.step(actions[episode.match.length % actions.length]);
  return episode.match.cells;
}"""


def episode(run: Path, start: list[list[int]], agent: int, actions: list[int]) -> list[list[list[int]]]:
    """Everybody's cells, by the environment and the last champions' files, with one agent that is told its actions."""
    directory = RunDirectory(run)
    hunters, hunted = (Team.load(directory.champion_file(role, 23)) for role in ("predators", "prey"))
    env = PredPreyEnv(directory.read_config().env)
    observations, _ = env.reset(options={"starts": start})
    name = env.possible_agents[agent]
    cells = [start]
    while env.agents:
        chosen = hunters.act(observations) | hunted.act(observations)
        if name in chosen:
            chosen[name] = actions[(len(cells) - 1) % len(actions)]
        observations, *_ = env.step(chosen)
        state = env.state().astype(int)
        cells.append(np.stack([state[:N_AGENTS], state[N_AGENTS : 2 * N_AGENTS]], axis=1).tolist())
    return cells


@pytest.mark.slow
@pytest.mark.parametrize(("agent", "actions"), [(1, [0, 2, IDLE, IDLE, 1]), (3, [3, 3, 0]), (4, [2])])
def test_a_steered_agent_plays_in_the_world_of_all_others(
    agent: int, actions: list[int], runs: list[Path], page_file: Path, open_page: OpenPage, data_of: Any
) -> None:
    start = data_of(page_file)["starts"][1]
    tab = open_page(page_file)
    played = tab(STEERED, [start, agent, actions])
    assert played == episode(runs[0], start, agent, actions)
    assert played != tab(
        "(start) => predprey.player.played(predprey.player.predators, predprey.player.prey, start).match.cells", start
    )
    tab.assert_quiet()


@pytest.mark.slow
def test_arrow_keys_steer_prey_and_the_page_says_how_it_went(
    runs: list[Path], page_file: Path, open_page: OpenPage, data_of: Any
) -> None:
    start = data_of(page_file)["starts"][0]
    tab = open_page(page_file)
    tab("() => predprey.player.show({ start: 0 })")
    usual = tab("() => predprey.player.match.caughtAt.map((at) => Number.isFinite(at) ? at : 0)")[0]
    tab.page.locator("#be").select_option("3")
    tab.page.locator("#begin").click()
    said = tab.page.locator("#how-it-went")
    assert said.inner_text().startswith("You are prey a, the one with the ring. Do not let a predator reach your cell.")
    assert tab("() => predprey.player.live.episode.match.length") == 0  # it waits for the first move
    tab("() => { predprey.player.speed = 20; }")
    tab.page.keyboard.press("ArrowUp")
    tab.until("predprey.player.live === null")
    played = episode(runs[0], start, 3, [2])
    assert tab("() => predprey.player.match.cells") == played  # the replay
    yours = tab("() => predprey.player.match.caughtAt.map((at) => Number.isFinite(at) ? at : 0)")[0]
    went = f"You were caught at step {yours}." if yours else f"You escaped for all {len(played) - 1} steps."
    other = f"is caught at step {usual}" if usual else "escapes"
    assert said.inner_text() == f"{went} The evolved prey a in your place {other}."
    tab("() => predprey.player.show({ start: 1 })")
    assert said.inner_text().startswith("Take the place of one agent")
    tab.assert_quiet()


@pytest.mark.slow
def test_predators_stand_still_at_space_and_prey_cannot(page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file)
    tab("() => { predprey.player.speed = 4; }")
    tab.page.locator("#be").select_option("0")
    tab.page.locator("#begin").click()
    tab.page.keyboard.press(" ")
    bar = "() => { const bar = document.getElementById('scrub'); return [Number(bar.value), Number(bar.max)]; }"
    assert tab(bar)[1] == tab("() => predprey.player.env.max_cycles")
    tab.until("predprey.player.live.episode.match.length > 3")
    assert tab(bar)[0] > 3
    assert set(tab("() => predprey.player.live.episode.match.actions.map((actions) => actions[0])")) == {IDLE}
    tab.page.keyboard.press("Escape")
    assert tab.page.locator("#how-it-went").inner_text() == "You stopped."
    assert tab("() => predprey.player.live") is None
    assert tab(bar)[1] == tab("() => predprey.player.match.length")
    tab.page.locator("#be").select_option("3")
    tab.page.locator("#begin").click()
    assert not tab.page.locator("#go-idle").is_visible()
    tab.page.keyboard.press(" ")
    tab.page.wait_for_timeout(200)
    assert tab("() => predprey.player.live.episode.match.length") == 0
    tab.page.locator("#begin").click()
    assert tab("() => predprey.player.live") is None
    tab.assert_quiet()


@pytest.mark.slow
def test_a_team_says_what_it_caught(page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file)
    evolved = tab("() => [predprey.player.match.caughtAt.filter(Number.isFinite).length, predprey.player.match.length]")
    tab.page.locator("#be").select_option("2")
    tab.page.locator("#begin").click()
    tab("() => { predprey.player.speed = 20; }")
    tab.page.keyboard.press("ArrowLeft")
    tab.until("predprey.player.live === null")
    yours = tab("() => [predprey.player.match.caughtAt.filter(Number.isFinite).length, predprey.player.match.length]")
    assert tab.page.locator("#how-it-went").inner_text() == (
        f"Your team caught {yours[0]} of 2 prey in {yours[1]} steps. With the evolved predator 2 in your place it "
        f"catches {evolved[0]} in {evolved[1]} steps."
    )
    tab.page.locator("#thoughts [aria-pressed]", has_text="predator 2").click()
    tab("() => predprey.player.seek(0)")
    assert "predator 2 goes west: you steered it." in tab.page.locator("#thoughts").inner_text()
    tab.page.locator("#link").click()
    assert tab.page.locator("#linked").inner_text() == "A game of your own has no link."
    tab.assert_quiet()


@pytest.mark.slow
def test_on_a_phone_buttons_steer(page_file: Path, open_page: OpenPage) -> None:
    tab = open_page(page_file, viewport={"width": 360, "height": 740}, has_touch=True, is_mobile=True)
    tab.page.locator("#be").select_option("0")
    tab.page.locator("#begin").tap()
    for name in ("north", "west", "south", "east", "idle"):
        box = tab.page.locator(f"#go-{name}").bounding_box()
        assert box["y"] >= 0
        assert box["y"] + box["height"] <= 740
        assert min(box["width"], box["height"]) >= 44
    assert tab.page.locator("#world").bounding_box()["y"] >= 0
    tab("() => { predprey.player.speed = 4; }")
    tab.page.locator("#go-east").tap()
    tab.until("predprey.player.live.episode.match.length > 2")
    assert set(tab("() => predprey.player.live.episode.match.actions.map((actions) => actions[0])")) == {0}
    tab.page.locator("#toggle").tap()  # the match instead
    assert tab("() => [predprey.player.live, predprey.player.playing]") == [None, True]
    tab.assert_quiet()
