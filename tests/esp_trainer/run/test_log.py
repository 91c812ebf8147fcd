"""The log of a run, its timing, and its champions."""

from __future__ import annotations

import json
from itertools import islice
from pathlib import Path
from typing import Any

import pytest

import predprey_env
from esp_trainer.config import RunConfig
from esp_trainer.esp.team import Team
from esp_trainer.files import DamagedFileError
from esp_trainer.presets import preset
from esp_trainer.types import ROLES

SMOKE = preset("smoke")


def test_a_log_shorter_than_its_checkpoint_is_refused_and_left_alone(
    tiny: RunConfig, tmp_path: Path, start: Any, resume: Any, snapshot: Any
) -> None:
    list(start(tmp_path / "run", tiny).generations())
    log = tmp_path / "run/metrics.jsonl"
    log.write_bytes(log.read_bytes()[:-1])
    before = snapshot(tmp_path / "run")
    with pytest.raises(DamagedFileError, match=r"metrics\.jsonl must hold 6 whole lines, got 5$"):
        resume(tmp_path / "run")
    log.unlink()
    with pytest.raises(DamagedFileError, match=r"metrics\.jsonl must hold 6 whole lines, got 0$"):
        resume(tmp_path / "run")
    assert {**snapshot(tmp_path / "run"), "metrics.jsonl": before["metrics.jsonl"]} == before


def test_a_log_whose_lines_are_not_its_generations_is_refused(
    tiny: RunConfig, tmp_path: Path, start: Any, resume: Any
) -> None:
    """Two processes that wrote to one run leave such a log."""
    list(start(tmp_path / "run", tiny).generations())
    log = tmp_path / "run/metrics.jsonl"
    first, second, *others = log.read_bytes().splitlines(keepends=True)
    log.write_bytes(b"".join([first, first, second, *others]))
    with pytest.raises(DamagedFileError, match=r"metrics\.jsonl"):
        resume(tmp_path / "run")


def test_an_old_log_may_be_without_its_timing(
    tiny: RunConfig, tmp_path: Path, start: Any, resume: Any, snapshot: Any, uninterrupted: Any
) -> None:
    list(islice(start(tmp_path / "run", tiny).generations(), 4))
    (tmp_path / "run/timing.jsonl").unlink()
    list(resume(tmp_path / "run").generations())
    assert snapshot(tmp_path / "run") == uninterrupted(tiny)


def test_a_log_has_a_line_for_each_generation(tmp_path: Path, start: Any) -> None:
    generations = list(start(tmp_path, SMOKE.replace(generations=3)).generations())
    lines = [json.loads(line) for line in (tmp_path / "metrics.jsonl").read_text().splitlines()]
    assert [line["generation"] for line in lines] == [0, 1, 2]
    for line, generation in zip(lines, generations, strict=True):
        assert set(line) == {"generation", "trials", "champions", "subpopulations", "held_out"}
        assert line["held_out"] == generation.held_out.as_dict()
        for role, trials in generation.trials.items():
            assert line["trials"][role] == {
                "mean": pytest.approx(trials.fitness.mean()),
                "best": pytest.approx(trials.fitness.mean(axis=1).max()),
                "caught": pytest.approx(trials.payoff),
            }
            assert line["trials"][role]["mean"] < line["trials"][role]["best"] <= 25
            assert line["champions"][role] == generation.champions[role].score
            signal = generation.signals[role]
            told = generation.spreads[role]._asdict() | {"signal": signal.share, "ties": signal.ties}
            assert line["subpopulations"][role] == pytest.approx(told, abs=5e-5)


def test_subpopulations_are_measured_before_they_breed(tmp_path: Path, start: Any) -> None:
    trainer = start(tmp_path, SMOKE.replace(generations=1))
    before = {role: side.algorithm.spread() for role, side in trainer.coevolution.evolving.items()}
    (generation,) = trainer.generations()
    assert generation.spreads == before
    assert all(side.algorithm.spread() != before[role] for role, side in trainer.coevolution.evolving.items())


def test_timing_has_a_line_for_each_generation_with_the_seconds_of_each_phase(
    tiny: RunConfig, tmp_path: Path, start: Any
) -> None:
    list(start(tmp_path, tiny).generations())
    lines = [json.loads(line) for line in (tmp_path / "timing.jsonl").read_text().splitlines()]
    assert [line.pop("generation") for line in lines] == list(range(6))
    for line in lines:
        assert set(line) == {"trials", "champions", "held_out", "breeding", "files"}
        assert all(0 < seconds < 60 for seconds in line.values())


def test_every_champion_is_a_team_that_says_where_it_came_from(tmp_path: Path, start: Any) -> None:
    config = SMOKE.replace(generations=2, seed=5)
    generations = list(start(tmp_path, config).generations())
    for role in ("predators", "prey"):
        for generation in generations:
            team = Team.load(tmp_path / f"champions/{role}-{generation.number:05d}.safetensors")
            champion = generation.champions[role]
            assert team.role == role
            assert team.side == config.predators
            assert (team.genomes == champion.genomes).all()
            assert team.provenance == {
                **config.model_dump(exclude={"generations", "checkpoint_every", "genealogy"}),
                "version": predprey_env.__version__,
                "generation": generation.number,
                "score": champion.score,
                "held_out": generation.held_out.as_dict(),
            }


def test_of_a_run_longer_than_its_hall_of_fame_every_second_champion_is_kept(
    tmp_path: Path, start: Any, resume: Any
) -> None:
    trainer = start(tmp_path, SMOKE.replace(esp=SMOKE.esp.replace(hof_size=5), checkpoint_every=4, generations=14))

    def kept() -> list[int]:
        both = [trainer.directory.champion_generations(role) for role in ROLES]
        assert both[0] == both[1]
        return both[0]

    by_generation = {}
    for generation in trainer.generations():
        by_generation[generation.number] = kept()
    assert by_generation[4] == [0, 1, 2, 3, 4]
    assert by_generation[6] == [0, 1, 2, 3, 4, 5, 6]  # until the checkpoint that can do without them
    assert by_generation[8] == [0, 2, 4, 6, 7, 8]  # generation 7's checkpoint has gone through them
    assert kept() == [0, 4, 8, 12, 13]
    assert [len(side.hall_of_fame) for side in trainer.coevolution.evolving.values()] == [5, 5]


def test_only_a_side_that_evolves_has_champions(tmp_path: Path, start: Any) -> None:
    list(start(tmp_path, SMOKE.replace(prey=SMOKE.prey.replace(policy="flee_nearest"), generations=2)).generations())
    assert sorted(file.name for file in (tmp_path / "champions").iterdir()) == [
        "predators-00000.safetensors",
        "predators-00001.safetensors",
    ]
