"""``esp-trainer behaviours``: the rates that it prints and writes are those that were counted."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from esp_trainer.analysis.behaviours.registry import BEHAVIOURS
from esp_trainer.analysis.history import History
from esp_trainer.analysis.inference import over_seeds
from esp_trainer.analysis.watch import watch_behaviours
from esp_trainer.cli import main
from esp_trainer.evaluation.fused import FusedEvaluator

N = 9
EPISODES = 16
NAMES = [*BEHAVIOURS, "specialisation"]


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Runs of three seeds, and two others."""
    place = tmp_path_factory.mktemp("runs")
    for name, options in {
        "first": [],
        "second": ["--seed", "1"],
        "third": ["--seed", "2"],
        "fleeing": ["--prey.policy", "flee_nearest"],
        "one prey": ["--env.n_prey", "1"],
    }.items():
        arguments = ["train", "smoke", "--out", str(place / name), "--quiet", "--generations", str(N), *options]
        assert main(arguments) == 0
    return place


def rates_of(run: Path, generations: list[int]) -> np.ndarray:
    """Rate and rate by chance, ``(n_behaviours, n_generations, 2)``."""
    history = History.of_run(run)
    evaluator = FusedEvaluator(history.config.env, threads=1)
    found = watch_behaviours(history, evaluator, np.array(generations), n_episodes=EPISODES)
    return np.array([[(rate.rate, rate.null) for rate in found[name]] for name in NAMES])


def excess(rates: np.ndarray) -> np.ndarray:
    """In per cent; where chance has no meaning, the rate."""
    return 100 * np.where(np.isnan(rates[..., 1]), rates[..., 0], rates[..., 0] - rates[..., 1])


def table_of(out: str) -> tuple[list[int], dict[str, list[str]]]:
    """Generations, and cells by behaviour."""
    _, header, *lines = out.splitlines()
    rows = {line[:22].strip(): line[22:].split() for line in lines if line[:22].strip() in NAMES}
    assert list(rows) == NAMES
    assert header.startswith("generation")
    return list(map(int, header.split()[1:])), rows


@pytest.mark.parametrize("name", ["first", "fleeing", "one prey"])
def test_a_run_is_told_by_rates_over_chance(name: str, esp_trainer: Callable[..., Any], place: Path) -> None:
    outcome = esp_trainer("behaviours", place / name, "--episodes", EPISODES, "--generations", "3")
    assert outcome.code == 0
    assert outcome.out.startswith(f"{EPISODES} episodes a generation, ")
    generations, rows = table_of(outcome.out)
    assert generations == [0, 4, 8]
    for cells, values in zip(rows.values(), excess(rates_of(place / name, generations)), strict=True):
        assert cells == ["-" if math.isnan(value) else f"{value:z.0f}" for value in values]
    assert "intervals" not in outcome.out


def test_what_takes_two_prey_is_not_told_of_one(esp_trainer: Callable[..., Any], place: Path) -> None:
    outcome = esp_trainer("behaviours", place / "one prey", "--episodes", EPISODES, "--generations", "3")
    _, rows = table_of(outcome.out)
    assert rows["herding"] == ["-", "-", "-"]
    assert "-" not in rows["attacker"]


def test_of_two_runs_the_mean_is_told_without_an_interval(esp_trainer: Callable[..., Any], place: Path) -> None:
    runs = place / "first", place / "second"
    outcome = esp_trainer("behaviours", *runs, "--episodes", EPISODES, "--generations", "3")
    assert outcome.out.splitlines()[-1] == "means of 2 runs"
    assert "±" not in outcome.out
    generations, rows = table_of(outcome.out)
    means = np.mean([excess(rates_of(run, generations)) for run in runs], axis=0)
    assert rows["idling"] == [f"{value:z.0f}" for value in means[NAMES.index("idling")]]


def test_of_several_runs_the_mean_is_told_with_its_interval(esp_trainer: Callable[..., Any], place: Path) -> None:
    runs = place / "first", place / "second", place / "third"
    outcome = esp_trainer("behaviours", *runs, "--episodes", EPISODES, "--generations", "3")
    assert outcome.code == 0
    assert "means of 3 runs, with half their 95% intervals behind ±" in outcome.out
    generations, rows = table_of(outcome.out)
    values = np.array([excess(rates_of(run, generations)) for run in runs])
    told = 0
    for row, cells in enumerate(rows.values()):
        for column, cell in enumerate(cells):
            both = values[:, row, column]
            if not np.isnan(both).any():
                estimate = over_seeds(both)
                assert cell == f"{estimate.mean:z.0f}±{estimate.high - estimate.mean:.0f}"
                told += 1
    assert told > 30


def test_the_table_holds_every_generation_that_was_watched(
    esp_trainer: Callable[..., Any], place: Path, tmp_path: Path
) -> None:
    """The terminal has room for seven of them."""
    runs = place / "first", place / "second"
    outcome = esp_trainer("behaviours", *runs, "--episodes", EPISODES, "--csv", "table.csv")
    assert outcome.code == 0
    assert "table.csv" in outcome.out
    with (tmp_path / "table.csv").open(newline="") as file:
        header, *rows = csv.reader(file)
    assert header == ["run", "generation", "behaviour", "rate", "rate by chance", "meaning"]
    assert len(rows) == 2 * N * len(NAMES)
    expected = {run: rates_of(run, list(range(N))) for run in runs}
    for run, generation, behaviour, rate, chance, meaning in rows:
        counted = expected[Path(run)][NAMES.index(behaviour), int(generation)]
        assert [float(rate), float(chance)] == pytest.approx(counted, rel=1e-5, nan_ok=True)
        assert meaning == (BEHAVIOURS[behaviour].meaning if behaviour in BEHAVIOURS else "predators keep to a role")
    shown, _ = table_of(outcome.out.split("\n", 1)[1])
    assert len(shown) == 7
    assert (shown[0], shown[-1]) == (0, N - 1)


@pytest.mark.parametrize("where", ["nowhere/table.csv", "directory", "file/table.csv", "/proc/table.csv"])
def test_a_table_that_cannot_be_written_is_told_in_one_line(
    where: str, esp_trainer: Callable[..., Any], place: Path, tmp_path: Path
) -> None:
    (tmp_path / "directory").mkdir()
    (tmp_path / "file").write_text("hello")
    if where.startswith("/proc") and not Path("/proc").exists():
        pytest.skip("this system has no /proc")
    options = ["--episodes", EPISODES, "--generations", "1", "--csv", where]
    outcome = esp_trainer("behaviours", place / "first", *options)
    assert outcome.code == 1
    refusal = outcome.err.splitlines()[-1]
    assert refusal.startswith(f"esp-trainer: {where}: ")
    assert len(outcome.err.splitlines()) <= 2, "the first says that a run is being watched"
    assert (tmp_path / "file").read_text() == "hello"
