"""A run that dies at any moment is gone on with to the same bytes."""

from __future__ import annotations

import errno
import os
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import disk
import pytest

from esp_trainer.config import RunConfig
from esp_trainer.run.directory import RunDirectory
from esp_trainer.run.trainer import Trainer

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator


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
