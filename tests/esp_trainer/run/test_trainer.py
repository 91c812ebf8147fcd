"""A run is the same bytes however it was stopped, gone on with, or spread over threads."""

from __future__ import annotations

import math
from itertools import islice
from pathlib import Path
from typing import Any

import pytest

from esp_trainer.config import RunConfig
from esp_trainer.files import read_arrays
from esp_trainer.presets import preset

SMOKE = preset("smoke")


def _esp(**fields: Any) -> RunConfig:
    return SMOKE.replace(esp=SMOKE.esp.replace(**fields))


VARIANTS = {
    "smoke": SMOKE,
    "another seed": SMOKE.replace(seed=2**63 - 1),
    "burst": _esp(burst_after=3),
    "mixed": _esp(pairing="mixed"),
    "hall_of_fame": _esp(pairing="hall_of_fame"),
    "previous_champion": _esp(pairing="previous_champion"),
    "a small hall of fame": _esp(hof_size=5),
    "a small hall of fame that is met": _esp(hof_size=3, pairing="hall_of_fame"),
    "scripted prey": SMOKE.replace(prey=SMOKE.prey.replace(policy="flee_nearest")),
    "scripted predators": SMOKE.replace(predators=SMOKE.predators.replace(policy="greedy_chase")),
    "monolithic with bias": SMOKE.replace(prey=SMOKE.prey.replace(controller="monolithic", bias=True)),
    "argmax": SMOKE.replace(champion=SMOKE.champion.replace(method="argmax")),
    "memory, blocks and a pool": _esp(
        **{"memory": 0.8, "prior_trials": 20, "block_size": 10},
        **{"past_share": 0.5, "past_choice": "contested", "past_each_episode": True},
    ).replace(champion=SMOKE.champion.replace(n_past=3)),
    "exploiters": _esp(past_share=0.5, past_choice="hard", exploiters_every=4, exploiter_generations=2),
    "a genealogy": _esp(burst_after=3, hof_size=5).replace(genealogy=True),
    "mixed, burst, scripted prey": _esp(pairing="mixed", burst_after=2).replace(
        prey=SMOKE.prey.replace(policy="flee_nearest")
    ),
}


def _done(path: Path) -> int:
    return int(read_arrays(path / "checkpoint.safetensors", "checkpoint")[0]["generations"])


@pytest.mark.parametrize("config", VARIANTS.values(), ids=VARIANTS)
def test_ten_generations_and_ten_more_have_the_bytes_of_twenty(
    config: RunConfig, tmp_path: Path, start: Any, resume: Any, snapshot: Any, uninterrupted: Any
) -> None:
    list(start(tmp_path / "halves", config.replace(generations=10)).generations())
    list(resume(tmp_path / "halves", 20).generations())
    assert snapshot(tmp_path / "halves") == uninterrupted(config)


def test_a_run_with_bursts_has_them_in_both_halves_and_is_waiting_for_one_between(tmp_path: Path, start: Any) -> None:
    """Or the test above would not see whether the wait for a burst outlives a restart."""
    trainer = start(tmp_path, VARIANTS["burst"])
    bursts = []
    for generation in trainer.generations():
        sides = trainer.coevolution.evolving.values()
        bursts += [generation.number for side in sides if side.best == -math.inf]
        if generation.number == 9:
            assert any(side.stagnant for side in sides)
    assert min(bursts) < 10 <= max(bursts)


@pytest.mark.parametrize("config", [SMOKE, VARIANTS["mixed"]], ids=["smoke", "mixed"])
def test_threads_do_not_change_a_byte(config: RunConfig, tmp_path: Path, start: Any, snapshot: Any) -> None:
    runs = []
    for threads in (1, 2, 7):
        list(start(tmp_path / str(threads), config, threads).generations())
        runs.append(snapshot(tmp_path / str(threads)))
    assert runs[0] == runs[1] == runs[2]


def test_another_seed_is_another_run(tiny: RunConfig, tmp_path: Path, start: Any) -> None:
    logs = []
    for seed in (0, 1):
        list(start(tmp_path / str(seed), tiny.replace(seed=seed)).generations())
        logs.append((tmp_path / str(seed) / "metrics.jsonl").read_bytes())
    assert logs[0] != logs[1]


def test_how_often_a_run_is_saved_changes_neither_log_nor_champions(
    tiny: RunConfig, tmp_path: Path, start: Any, snapshot: Any, uninterrupted: Any
) -> None:
    list(start(tmp_path / "rarely", tiny.replace(checkpoint_every=100)).generations())
    often, rarely = uninterrupted(tiny), snapshot(tmp_path / "rarely")
    assert often.keys() == rarely.keys()
    assert {name for name in often if often[name] != rarely[name]} == {"config.json", "checkpoint.safetensors"}


def test_a_run_that_is_told_to_stop_ends_after_the_generation_in_hand_and_loses_nothing(
    tiny: RunConfig, tmp_path: Path, start: Any, resume: Any, snapshot: Any, uninterrupted: Any
) -> None:
    trainer = start(tmp_path / "run", tiny)
    seen = []
    for generation in trainer.generations():
        seen.append(generation.number)
        if generation.number == 2:
            trainer.stop()
    assert seen == [0, 1, 2]
    assert _done(tmp_path / "run") == 3
    resumed = resume(tmp_path / "run")
    assert resumed.done == 3
    assert [generation.number for generation in resumed.generations()] == [3, 4, 5]
    assert snapshot(tmp_path / "run") == uninterrupted(tiny)


def test_resuming_a_complete_run_changes_nothing(
    tiny: RunConfig, tmp_path: Path, start: Any, resume: Any, snapshot: Any
) -> None:
    list(start(tmp_path / "run", tiny).generations())
    before = snapshot(tmp_path / "run")
    assert list(resume(tmp_path / "run").generations()) == []
    assert snapshot(tmp_path / "run") == before


def test_a_run_cannot_be_resumed_to_fewer_generations_than_its_checkpoint_holds(
    tiny: RunConfig, tmp_path: Path, start: Any, resume: Any, snapshot: Any
) -> None:
    list(start(tmp_path / "run", tiny).generations())
    before = snapshot(tmp_path / "run")
    with pytest.raises(ValueError, match=r"^generations must be at least the 6 that this run has done, got 5$"):
        resume(tmp_path / "run", 5)
    assert snapshot(tmp_path / "run") == before


@pytest.mark.parametrize("generations", [4, 5])
def test_a_killed_run_that_is_resumed_to_fewer_generations_keeps_no_champion_of_later_ones(
    generations: int, tiny: RunConfig, tmp_path: Path, start: Any, resume: Any, snapshot: Any, uninterrupted: Any
) -> None:
    path = tmp_path / "run"
    list(islice(start(path, tiny.replace(generations=60, checkpoint_every=4)).generations(), 7))
    list(resume(path, generations).generations())
    expected, found = uninterrupted(tiny.replace(generations=generations, checkpoint_every=4)), snapshot(path)
    assert found.keys() == expected.keys()
    different = {name for name in found if found[name] != expected[name]}
    assert different <= {"checkpoint.safetensors"}, "which may remember how long the run was to be"
