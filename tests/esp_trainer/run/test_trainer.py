"""A run is the same bytes however it was stopped, gone on with, or spread over threads."""

from __future__ import annotations

import errno
import json
import math
import os
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import disk
import pytest

import predprey_env
from esp_trainer.config import RunConfig
from esp_trainer.esp.team import Team
from esp_trainer.files import DamagedFileError, read_arrays
from esp_trainer.presets import preset
from esp_trainer.run.directory import RunDirectory
from esp_trainer.run.trainer import Trainer
from esp_trainer.types import ROLES

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

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


def test_every_generation_is_a_good_place_to_die(
    tiny: RunConfig, tmp_path: Path, start: Any, resume: Any, snapshot: Any, uninterrupted: Any
) -> None:
    whole = uninterrupted(tiny)
    for generation in range(1, tiny.generations + 1):
        path = tmp_path / str(generation)
        list(islice(start(path, tiny).generations(), generation))
        trainer = resume(path)
        assert trainer.done == (generation if generation == tiny.generations else generation // 2 * 2)
        list(trainer.generations())
        assert snapshot(path) == whole, generation


def test_a_run_that_dies_again_and_again_still_ends_the_same(
    tiny: RunConfig, tmp_path: Path, start: Any, resume: Any, snapshot: Any, uninterrupted: Any
) -> None:
    path = tmp_path / "run"
    list(islice(start(path, tiny).generations(), 1))
    for lived in (3, 1, 3, 1):
        list(islice(resume(path).generations(), lived))
    list(resume(path).generations())
    assert snapshot(path) == uninterrupted(tiny)


class _Killed(BaseException):
    """The process is gone: no handler of its own runs."""


@pytest.fixture
def file_operations(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[Any]]:
    """``[count, at, error]``: counts the syncs and renames of all writes, and raises ``error()`` at number ``at``."""
    state: list[Any] = [0, None, _Killed]

    def counted(function: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            state[0] += 1
            if state[0] - 1 == state[1]:
                raise state[2]()
            return function(*arguments)

        return call

    monkeypatch.setattr(os, "fsync", counted(os.fsync))
    monkeypatch.setattr(Path, "replace", counted(Path.replace))
    yield state
    state[1] = None


def _no_space() -> OSError:
    return OSError(errno.ENOSPC, "No space left on device")


@pytest.mark.parametrize(
    ("error", "generations"),
    [
        (_Killed, 3),
        pytest.param(_Killed, 5, marks=pytest.mark.slow),
        pytest.param(_no_space, 5, marks=pytest.mark.slow),
    ],
    ids=["death", "death in a longer run", "a full disk"],
)
def test_a_run_that_stops_at_any_sync_or_rename_resumes_to_the_same_bytes(
    error: Any,
    generations: int,
    tiny: RunConfig,
    tmp_path: Path,
    start: Any,
    resume: Any,
    snapshot: Any,
    uninterrupted: Any,
    file_operations: list[Any],
) -> None:
    config = tiny.replace(generations=generations)
    whole = uninterrupted(config)
    n_operations = file_operations[0]
    file_operations[2] = error
    start(tmp_path / "begun", config)
    n_before = file_operations[0] - n_operations
    assert n_operations - n_before > 6 * generations
    for at in range(n_before, n_operations):
        path = tmp_path / str(at)
        file_operations[:2] = [0, at]
        trainer = start(path, config)
        with pytest.raises((_Killed, OSError)):
            list(trainer.generations())
        file_operations[1] = None
        resumed = resume(path)
        assert 0 <= trainer.done - resumed.done <= config.checkpoint_every, at
        list(resumed.generations())
        assert snapshot(path) == whole, at


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="takes a disk that is always full")
@pytest.mark.parametrize("log", ["metrics", "timing"])
def test_a_log_that_does_not_fit_on_the_disk_leaves_the_run_to_whoever_goes_on(
    log: str, tiny: RunConfig, tmp_path: Path, start: Any, resume: Any, snapshot: Any, uninterrupted: Any
) -> None:
    """Closing it fails as well."""
    trainer = start(tmp_path / "run", tiny)
    file = tmp_path / f"run/{log}.jsonl"
    file.symlink_to("/dev/full")
    with pytest.raises(OSError, match=rf"No space left on device: '{file}'"):
        list(trainer.generations())
    file.unlink()
    list(resume(tmp_path / "run").generations())
    assert snapshot(tmp_path / "run") == uninterrupted(tiny)


def test_a_run_that_stops_while_it_resumes_resumes_to_the_same_bytes(
    tiny: RunConfig,
    tmp_path: Path,
    start: Any,
    resume: Any,
    snapshot: Any,
    uninterrupted: Any,
    file_operations: list[Any],
) -> None:
    whole = uninterrupted(tiny)
    for at in range(6):
        path = tmp_path / str(at)
        list(islice(start(path, tiny.replace(generations=5)).generations(), 3))
        file_operations[:2] = [0, at]
        with pytest.raises(_Killed):
            list(resume(path, 6).generations())
        file_operations[1] = None
        list(resume(path, 6).generations())
        assert snapshot(path) == whole, at


def test_a_checkpoint_is_written_when_all_that_it_knows_of_is_on_disk(
    tiny: RunConfig, tmp_path: Path, start: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Or a machine that loses power could have a checkpoint without its log or its champions."""
    order: list[str] = []
    generations = start(tmp_path / "run", tiny.replace(generations=1)).generations()
    disk.spy(
        monkeypatch,
        lambda path: order.append(f"sync {path.relative_to(tmp_path)}"),
        lambda _, target: order.append(f"rename {target.relative_to(tmp_path)}"),
    )
    list(generations)
    at = order.index("rename run/checkpoint.safetensors")
    before, after = order[:at], order[at + 1 :]
    for role in ("predators", "prey"):
        named = before.index(f"rename run/champions/{role}-00000.safetensors")
        assert f"sync run/champions/.{role}-00000.safetensors.part" in before[:named]
        assert "sync run/champions" in before[named:]
    assert "sync run/metrics.jsonl" in before
    assert before[-1] == "sync run/.checkpoint.safetensors.part"
    assert "sync run" in after


@pytest.mark.parametrize("at", [0, 1])
def test_a_run_that_dies_before_it_has_a_config_can_be_begun_again(
    at: int, tiny: RunConfig, tmp_path: Path, start: Any, snapshot: Any, uninterrupted: Any, file_operations: list[Any]
) -> None:
    whole = uninterrupted(tiny)
    file_operations[:2] = [0, at]
    with pytest.raises(_Killed):
        start(tmp_path / "run", tiny)
    file_operations[1] = None
    list(start(tmp_path / "run", tiny).generations())
    assert snapshot(tmp_path / "run") == whole


def test_a_run_that_could_not_begin_leaves_no_directory_behind(tiny: RunConfig, tmp_path: Path) -> None:
    def fail(_: RunConfig) -> Any:
        raise MemoryError("Unable to allocate 437. TiB")

    with pytest.raises(MemoryError):
        Trainer.start(RunDirectory(tmp_path / "run"), tiny, fail)
    assert not (tmp_path / "run").exists()


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
    trainer = start(tmp_path, _esp(hof_size=5).replace(checkpoint_every=4, generations=14))

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
    list(start(tmp_path, VARIANTS["scripted prey"].replace(generations=2)).generations())
    assert sorted(file.name for file in (tmp_path / "champions").iterdir()) == [
        "predators-00000.safetensors",
        "predators-00001.safetensors",
    ]
