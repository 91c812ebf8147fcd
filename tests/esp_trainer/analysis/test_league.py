"""Which champions of which runs come into a league, and which runs cannot be in one."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from esp_trainer.analysis.best_response import evolve_response
from esp_trainer.analysis.history import History
from esp_trainer.analysis.league import league_of_runs
from esp_trainer.coevolution.league import LeagueSource
from esp_trainer.config import RunConfig
from esp_trainer.esp.team import Team
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.presets import preset
from esp_trainer.run.directory import RunDirectory
from esp_trainer.run.trainer import Trainer
from esp_trainer.types import ROLES


def tiny(**fields: Any) -> RunConfig:
    smoke = preset("smoke")
    small: dict[str, Any] = {
        **{"predators": smoke.predators.replace(n_hidden=2), "prey": smoke.prey.replace(n_hidden=2)},
        "esp": smoke.esp.replace(subpopulation_size=8, n_trials=16, n_episodes=2, hof_size=6, past_share=0.5),
        "champion": smoke.champion.replace(n_candidates=2, n_held_out=8),
        "generations": 11,
    }
    return smoke.replace(**small).with_fields(fields)


def run(path: Path, config: RunConfig) -> Path:
    trainer = Trainer.start(RunDirectory(path), config, lambda config: FusedEvaluator(config.env, 1))
    list(trainer.generations())
    return path


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Runs of eleven generations, of which halls of fame keep 0, 2, 4, 6, 8 and 10; of one that is shorter, all."""
    place = tmp_path_factory.mktemp("league")
    return {
        "a": run(place / "a", tiny(seed=1)),
        "short": run(place / "short", tiny(seed=2, generations=3)),
        "scripted prey": run(place / "scripted", tiny(**{"seed": 3, "prey.policy": "flee_nearest"})),
    }


def champions(path: Path, role: str, generations: list[int]) -> list[list[float]]:
    teams = (Team.load(path / f"champions/{role}-{generation:05d}.safetensors") for generation in generations)
    return [team.genomes.tolist() for team in teams]


def test_champions_come_evenly_spread_run_by_run(runs: dict[str, Path]):
    league = league_of_runs([runs["short"], runs["a"]], tiny(), n_champions=3)
    assert league.sources == (
        LeagueSource(str(runs["short"]), "smoke", 2, (0, 1, 2)),
        LeagueSource(
            str(runs["a"]), "smoke", 1, (0, 4, 10)
        ),  # of six places 0, 2.5, which is rounded to the even one, and 5
    )
    assert list(league.genomes) == ["predators", "prey"]
    for role in ROLES:
        expected = champions(runs["short"], role, [0, 1, 2]) + champions(runs["a"], role, [0, 4, 10])
        assert league.genomes[role].tolist() == expected


def test_six_champions_of_a_run_are_taken_unless_it_has_fewer(runs: dict[str, Path]):
    league = league_of_runs([runs["a"], runs["short"]], tiny())
    assert [source.generations for source in league.sources] == [(0, 2, 4, 6, 8, 10), (0, 1, 2)]


def test_a_side_that_follows_a_script_brings_nobody(runs: dict[str, Path]):
    league = league_of_runs([runs["scripted prey"]], tiny())
    assert list(league.genomes) == ["predators"]
    both = league_of_runs([runs["scripted prey"], runs["a"]], tiny(), 2)
    assert {role: len(genomes) for role, genomes in both.genomes.items()} == {"predators": 4, "prey": 2}


@pytest.mark.parametrize(
    ("fields", "line"),
    [
        ({"env.size": 14}, "env.size is 12 there and 14 here"),
        ({"env.n_prey": 1}, "env.n_prey is 2 there and 1 here"),
        ({"predators.n_hidden": 3}, "predators.n_hidden is 2 there and 3 here"),
        ({"prey.controller": "monolithic"}, 'prey.controller is "split" there and "monolithic" here'),
        ({"prey.input_scale": 0.2}, "prey.input_scale is 1.0 there and 0.2 here"),
        ({"predators.output": "linear"}, 'predators.output is "logistic" there and "linear" here'),
    ],
)
def test_a_run_of_another_world_or_controller_is_refused(fields: dict[str, Any], line: str, runs: dict[str, Path]):
    with pytest.raises(ValueError, match=rf"^{runs['a']} cannot be in the league: {re.escape(line)}$"):
        league_of_runs([runs["a"]], tiny(**fields))


@pytest.mark.parametrize("fields", [{"env.prey_fitness": "complementary"}, {"esp.n_trials": 20}, {"generations": 1}])
def test_what_is_earned_and_how_teams_evolve_may_differ(fields: dict[str, Any], runs: dict[str, Path]):
    assert len(league_of_runs([runs["a"]], tiny(**fields)).genomes["prey"]) == 6


def test_the_controller_of_a_side_that_a_run_did_not_evolve_does_not_matter(runs: dict[str, Path]):
    config = tiny(**{"prey.n_hidden": 5})
    assert list(league_of_runs([runs["scripted prey"]], config).genomes) == ["predators"]


def test_a_directory_that_is_given_twice_or_holds_no_generation_is_refused(runs: dict[str, Path], tmp_path: Path):
    with pytest.raises(ValueError, match="runs must be different ones"):
        league_of_runs([runs["a"], runs["short"], runs["a"]], tiny())
    with pytest.raises(FileNotFoundError, match="holds no run"):
        league_of_runs([tmp_path], tiny())
    Trainer.start(RunDirectory(tmp_path / "new"), tiny(), lambda config: FusedEvaluator(config.env, 1))
    with pytest.raises(FileNotFoundError, match="has no checkpoint yet"):
        league_of_runs([tmp_path / "new"], tiny())


def test_a_run_in_memory_is_the_run_on_disk_and_its_history_holds_its_own_champions(
    runs: dict[str, Path], tmp_path: Path
):
    config, league = tiny(generations=4), league_of_runs([runs["a"]], tiny())
    evaluator = FusedEvaluator(config.env, 1)
    list(Trainer.start(RunDirectory(tmp_path / "run"), config, lambda _: evaluator, league).generations())
    (tmp_path / "run/league.safetensors").unlink()  # nobody needs it who only looks
    in_memory, on_disk = History.evolve(config, evaluator, league=league), History.of_run(tmp_path / "run")
    assert in_memory.config == on_disk.config == config.replace(league=league.digest)
    for role in ROLES:
        assert on_disk.champions[role].shape[0] == 4
        assert (in_memory.champions[role] == on_disk.champions[role]).all()
    with pytest.raises(ValueError, match="the config names the league"):
        History.evolve(on_disk.config, evaluator)
    assert evolve_response(on_disk, "prey", evaluator, n_generations=1, seed=5).generation == 3
