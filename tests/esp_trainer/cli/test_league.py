"""``train --league`` as a user meets it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from esp_trainer.coevolution.league import League
from esp_trainer.run.directory import RunDirectory

if TYPE_CHECKING:
    from collections.abc import Callable

POOL = ["--esp.past_share", "0.5"]


@pytest.fixture
def with_league(esp_trainer: Callable[..., Any], smoke_run: Path) -> Path:
    """A run of three generations whose league is one run."""
    outcome = esp_trainer("train", "smoke", *POOL, "--seed", 4, "--league", smoke_run, "--generations", 3)
    assert outcome.code == 0, outcome.err
    return Path("runs/smoke-seed4")


def test_train_with_a_league_copies_six_champions_of_each_side(with_league: Path, smoke_run: Path) -> None:
    config = RunDirectory(with_league).read_config()
    league = League.load(with_league / "league.safetensors", config.league)
    (source,) = league.sources
    assert (source.path, source.preset, source.seed) == (str(smoke_run), "smoke", 0)
    assert source.generations == (0, 4, 8, 11, 15, 19)
    assert {role: len(genomes) for role, genomes in league.genomes.items()} == {"predators": 6, "prey": 6}


def test_a_run_with_a_league_goes_on_and_can_be_looked_at(with_league: Path, esp_trainer: Callable[..., Any]) -> None:
    assert esp_trainer("resume", with_league, "--generations", 5).code == 0
    assert esp_trainer("show", with_league / "champions/prey-00004.safetensors").code == 0
    assert esp_trainer("behaviours", with_league, "--episodes", 2).code == 0


def test_a_run_whose_league_is_gone_is_not_gone_on_with(with_league: Path, esp_trainer: Callable[..., Any]) -> None:
    (with_league / "league.safetensors").unlink()
    refusal = esp_trainer("resume", with_league, "--generations", 5).refusal
    assert refusal == f"esp-trainer: {with_league}/league.safetensors is not there"


@pytest.mark.parametrize(
    ("options", "line"),
    [
        ([], "a league has no effect without esp.past_share or champion.n_past above 0"),
        ([*POOL, "--env.size", "14"], "{run} cannot be in the league: env.size is 12 there and 14 here"),
        ([*POOL, "--prey.n_hidden", "4"], "{run} cannot be in the league: prey.n_hidden is 10 there and 4 here"),
        (
            [*POOL, "--predators.policy", "greedy_chase"],
            '{run} cannot be in the league: predators.policy is "esp" there and "greedy_chase" here',
        ),
    ],
)
def test_what_is_refused_is_one_line_and_leaves_nothing(
    options: list[str], line: str, esp_trainer: Callable[..., Any], smoke_run: Path, tmp_path: Path
) -> None:
    refusal = esp_trainer("train", "smoke", *options, "--league", smoke_run).refusal
    assert refusal == "esp-trainer: " + line.format(run=smoke_run)
    assert list(tmp_path.iterdir()) == []


def test_a_league_needs_runs(esp_trainer: Callable[..., Any], tmp_path: Path) -> None:
    assert esp_trainer("train", "smoke", *POOL, "--league", "none").refusal.startswith("esp-trainer: none holds no run")
    assert "expected at least one argument" in esp_trainer("train", "smoke", *POOL, "--league").refusal
    assert list(tmp_path.iterdir()) == []


def test_a_sweep_has_no_league(esp_trainer: Callable[..., Any], tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text('preset = "smoke"\n[fields]\nleague = "abc"\n')
    expected = "esp-trainer: s.toml: league is no field of a sweep: only train begins a run with one"
    assert esp_trainer("sweep", "s.toml").refusal == expected
