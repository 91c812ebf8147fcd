"""Matches that are recorded, for pages with a network that has no translation to JavaScript."""

from __future__ import annotations

import base64
import html
import re
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from esp_trainer.analysis.history import History
from esp_trainer.cli import main
from esp_trainer.config import SideConfig
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.networks import respond
from esp_trainer.networks.feedforward import FeedForward, feed_forward
from esp_trainer.presets import preset
from esp_trainer.report import matches, recorded
from esp_trainer.types import ROLES
from predprey_env.jit import rule, zeros
from predprey_env.sight import Sight

DataOf = Callable[[Path], dict[str, Any]]
PlayedByEnvironment = Callable[[Path, int, int, list[list[int]]], list[list[list[int]]]]


class Odd(FeedForward):
    """A kind of network whose rule cannot be translated, as it has ``not in``. It computes what the paper's does."""


@respond.register(Odd)
@rule
def odd(network: Any, weights: Any, at: int, inputs: Any, n_inputs: int, first: int, memory: Any, context: int) -> Any:
    if n_inputs not in (0, -1):
        return feed_forward(network, weights, at, inputs, n_inputs, first, memory, context)
    return zeros(weights, network.blank)


def cells_of(match: dict[str, Any], n_agents: int, kind: str = "u1") -> list[Any]:
    """Everybody's cells in a recorded match, as lists."""
    return np.frombuffer(base64.b64decode(match["cells"]), kind).reshape(-1, n_agents, 2).tolist()  # type: ignore[no-any-return]


@pytest.fixture(scope="module")
def recorded_page(runs: list[Path], report: Callable[..., int], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of a run that is taken for one with a network without a translation."""
    place = tmp_path_factory.mktemp("recorded") / "page.html"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(matches, "kinds_in", lambda _: [FeedForward, Odd])
        assert report(runs[0], "--out", place) == 0
    return place


def test_the_kinds_of_network_and_sight_in_runs_are_named_once() -> None:
    """Without playing: every kind of network has a kernel of its own to compile."""
    paper = preset("paper-3v2")
    odd = paper.with_fields({"predators.network": f"{__name__}:Odd"})
    runs = [SimpleNamespace(config=config, champions=ROLES) for config in (odd, paper, odd)]
    assert matches.kinds_in(runs) == [Odd, FeedForward, Sight]  # type: ignore[arg-type]
    alone = SimpleNamespace(config=odd, champions=["predators"])
    assert matches.kinds_in([alone]) == [Odd, Sight]  # type: ignore[list-item]


def test_the_page_says_why_matches_are_recorded(recorded_page: Path) -> None:
    why = (
        "The matches are recorded, as the page cannot compute them: the rule of Odd has no translation to JavaScript "
        "(cannot translate 'n_inputs not in (0, -1)')."
    )
    assert why in html.unescape(recorded_page.read_text("utf-8"))


def test_each_chosen_generation_meets_each_from_each_start_and_moments_are_there(
    recorded_page: Path, data_of: DataOf
) -> None:
    data = data_of(recorded_page)
    chosen = {"generations": [0, 3, 7, 10, 13, 16, 20, 23]}  # those of the matrix
    assert data["runs"] == [{"name": "seed0", "sides": {"predators": chosen, "prey": chosen}}]
    assert len(data["starts"]) == recorded.STARTS
    assert data["moments"]
    asked = [
        (p, q, start) for p in data["matrix"]["predators"] for q in data["matrix"]["prey"] for start in data["starts"]
    ]
    asked += [(moment["generation"], moment["generation"], moment["start"]) for moment in data["moments"]]
    assert [(m["predators"], m["prey"], cells_of(m, 5)[0]) for m in data["recorded"]] == asked


def test_recorded_cells_are_those_of_the_environment(
    runs: list[Path], recorded_page: Path, data_of: DataOf, played_by_environment: PlayedByEnvironment
) -> None:
    found = data_of(recorded_page)["recorded"]
    for match in [*found[::17], found[-1]]:
        cells = cells_of(match, 5)
        assert cells == played_by_environment(runs[0], match["predators"], match["prey"], cells[0])
        for prey, caught in zip((3, 4), match["caught"], strict=True):
            met = [step for step, each in enumerate(cells) if each[prey] in each[:3]]
            assert caught == (met[0] if met else 0)


def test_recorded_matches_keep_to_their_budget(
    runs: list[Path], report: Callable[..., int], tmp_path: Path, data_of: DataOf, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(matches, "kinds_in", lambda _: [FeedForward, Odd])
    monkeypatch.setattr(recorded, "BUDGET", 20_000)  # 32 matches of 61 rows of 5 agents
    assert report(runs[0], "--out", tmp_path / "page.html") == 0
    data = data_of(tmp_path / "page.html")
    assert data["runs"][0]["sides"]["prey"] == {"generations": [0, 23]}
    assert sum(len(base64.b64decode(match["cells"])) for match in data["recorded"]) <= 20_000


def test_cells_of_a_large_torus_take_two_bytes() -> None:
    config = preset("paper-3v2")
    config = config.replace(
        generations=1,
        env=config.env.replace(size=300, max_cycles=5),
        esp=config.esp.replace(n_trials=40, n_episodes=2),
        champion=config.champion.replace(n_candidates=3, n_held_out=8),
        prey=SideConfig(policy="flee_nearest"),
    )
    evaluator = FusedEvaluator(config.env)
    history = History.evolve(config, evaluator)
    start = np.array([[299, 0], [0, 299], [150, 150], [20, 30], [257, 256]])
    (match,) = recorded.record_matches(history, evaluator, [(0, 0, start)])
    assert "prey" not in match  # a script has no generation
    assert match["caught"] == [0, 0]
    cells = cells_of(match, 5, "<u2")
    assert cells[0] == start.tolist()
    assert len(cells) == 6


STATE = """() => {
  const { player } = predprey;
  return { predators: player.predators.generation, prey: player.prey.generation, start: player.start, time: player.time,
    cells: player.match.cells };
}"""


@pytest.mark.slow
def test_a_page_of_recorded_matches_plays_them(
    recorded_page: Path, open_page: Callable[..., Any], data_of: DataOf
) -> None:
    data, tab = data_of(recorded_page), None
    tab = open_page(recorded_page)
    page = tab.page
    for hidden in ("#thoughts", "#yourself"):
        assert not page.locator(hidden).is_visible()
    assert (
        "These matches are recorded, for 8 generations of a side and 4 starts."
        in page.locator("#recorded").inner_text()
    )
    assert "A click on a cell plays the nearest recorded match." in page.locator("#matrix-figure").inner_text()
    page.locator("#prey").focus()
    page.keyboard.press("Home")
    page.locator("#start").focus()
    page.keyboard.press("End")
    shown = tab(STATE)
    assert (shown["predators"], shown["prey"], shown["start"]) == (23, 0, 3)
    recorded_ = next(
        m for m in data["recorded"] if (m["predators"], m["prey"]) == (23, 0) and cells_of(m, 5)[0] == data["starts"][3]
    )
    assert shown["cells"] == cells_of(recorded_, 5)
    page.locator("#forward").click()
    assert tab(STATE)["time"] == 1
    page.locator("#speed").select_option("8")
    page.locator("#toggle").click()
    tab.until("!predprey.player.playing && predprey.player.time === predprey.player.match.length")
    tab.assert_quiet()


@pytest.mark.slow
def test_links_and_moments_lead_to_recorded_matches(
    recorded_page: Path, open_page: Callable[..., Any], data_of: DataOf
) -> None:
    moment = next(m for m in data_of(recorded_page)["moments"] if m["generation"] not in (0, 3, 7, 10, 13, 16, 20, 23))
    title, generation = moment["title"], moment["generation"]
    tab = open_page(recorded_page, "#p=7&q=20&start=2&step=5")
    shown = tab(STATE)
    assert (shown["predators"], shown["prey"], shown["start"], shown["time"]) == (7, 20, 1, 5)
    tab.page.get_by_role("button", name=re.compile(f"^{title} ")).click()
    tab("() => predprey.player.pause()")
    shown = tab(STATE)
    assert (shown["predators"], shown["prey"], shown["start"]) == (generation, generation, moment["start"])
    tab.page.locator("#link").click()
    again = open_page(recorded_page, tab("() => location.hash"))
    assert again(STATE)["cells"] == shown["cells"]
    nearest = open_page(recorded_page, "#p=6&q=2&start=1,2,3,4,5,6,7,8,9,10&step=0")(STATE)
    assert (nearest["predators"], nearest["prey"], nearest["start"]) == (7, 3, 0)
    tab.assert_quiet()


@pytest.mark.slow
def test_a_page_of_several_runs_plays_both_sides_of_one(
    runs: list[Path], report: Callable[..., int], tmp_path: Path, open_page: Callable[..., Any], monkeypatch: Any
) -> None:
    monkeypatch.setattr(matches, "kinds_in", lambda _: [FeedForward, Odd])
    assert report(*runs, "--out", tmp_path / "page.html") == 0
    tab = open_page(tmp_path / "page.html", "#p=23&pr=1&q=0&qr=0&start=1&step=0")
    assert tab("() => [predprey.player.predators.run, predprey.player.prey.run]") == [1, 1]
    assert not tab.page.locator("#prey-run").is_visible()
    tab.page.locator("#predators-run").select_option("0")
    assert tab("() => [predprey.player.predators.run, predprey.player.prey.run]") == [0, 0]
    tab.assert_quiet()


@pytest.mark.slow
def test_a_page_of_recorded_matches_against_a_script_plays(
    report: Callable[..., int], tmp_path: Path, open_page: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(matches, "kinds_in", lambda _: [FeedForward, Odd])
    run = tmp_path / "run"
    world = ["--env.size", "24", "--env.max_cycles", "60", "--prey.policy", "flee_nearest"]
    assert main(["train", "smoke", *world, "--generations", "4", "--out", str(run), "--quiet"]) == 0
    assert report(run) == 0
    tab = open_page(run / "report.html")
    assert tab.page.locator(".choice .prey legend").inner_text() == "Prey by the script flee_nearest"
    assert tab(STATE)["predators"] == 3
    assert len(tab(STATE)["cells"]) > 1
    tab.assert_quiet()
