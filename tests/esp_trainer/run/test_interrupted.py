"""A generation happens wholly or not at all: whatever ends it, the trainer or another goes on to the same bytes."""

from __future__ import annotations

import errno
import os
import pickle
import sys
import threading
from copy import deepcopy
from itertools import islice
from pathlib import Path
from shutil import copytree
from typing import TYPE_CHECKING, Any

import pytest
from waiting import join

import esp_trainer
from esp_trainer.esp.subpopulations import Subpopulations
from esp_trainer.esp.team import Team
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.run import trainer as trainer_module
from esp_trainer.run.directory import Log, RunDirectory
from esp_trainer.run.trainer import Trainer
from esp_trainer.types import ScriptedTeams

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType

    from esp_trainer.config import RunConfig


def _evaluator(config: RunConfig) -> FusedEvaluator:
    return FusedEvaluator(config.env, threads=1)


FULL = OSError(errno.ENOSPC, "No space left on device")
LOST = ConnectionError("the cluster lost a task")
CTRL_C = KeyboardInterrupt()

# What fails, at which of its calls after the third generation, whether it has done its work by then, and how.
FAILURES: dict[str, tuple[Any, str, int, bool, BaseException]] = {
    "trials": (FusedEvaluator, "evaluate", 1, False, LOST),
    "champions": (FusedEvaluator, "evaluate", 2, False, CTRL_C),
    "champions measured": (FusedEvaluator, "evaluate", 3, False, CTRL_C),
    "a lost cluster": (FusedEvaluator, "evaluate", 3, False, LOST),
    "teams asked for": (Subpopulations, "ask", 1, True, CTRL_C),
    "one side bred": (Subpopulations, "tell", 1, True, CTRL_C),
    "both sides bred": (Subpopulations, "tell", 2, True, CTRL_C),
    "the first champion": (Team, "save", 1, False, FULL),
    "the second champion": (Team, "save", 2, False, FULL),
    "both champions saved": (Team, "save", 2, True, CTRL_C),
    "the log": (Log, "append", 1, False, FULL),
    "the log written": (Log, "append", 1, True, CTRL_C),
    "the times": (Log, "append", 2, False, FULL),
    "the log synced": (Log, "sync", 1, False, FULL),
    "a checkpoint": (trainer_module, "save_checkpoint", 1, False, FULL),
    "a checkpoint written": (trainer_module, "save_checkpoint", 1, True, CTRL_C),
    "a checkpoint synced": (trainer_module, "sync_directory", 2, True, FULL),
    "champions thinned": (RunDirectory, "keep_champions", 1, False, CTRL_C),
}


@pytest.fixture
def fail(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """``fail(owner, name, nth, after, error)``: one call of a function raises, before or after its work."""

    def arm(owner: Any, name: str, nth: int, after: bool, error: BaseException) -> None:
        works, calls = getattr(owner, name), iter(range(1, 1000))

        def once(*args: Any, **kwargs: Any) -> Any:
            this = next(calls)
            if this == nth and not after:
                raise error
            result = works(*args, **kwargs)
            if this == nth:
                raise error
            return result

        monkeypatch.setattr(owner, name, once)

    return arm


@pytest.mark.parametrize("failure", FAILURES.values(), ids=FAILURES)
def test_a_generation_that_fails_is_played_again_to_the_same_bytes(
    failure: Any,
    tiny: RunConfig,
    tmp_path: Path,
    start: Any,
    resume: Any,
    fail: Any,
    snapshot: Any,
    uninterrupted: Any,
) -> None:
    config = tiny.replace(esp=tiny.esp.replace(hof_size=3))  # so that champions go, too
    trainer = start(tmp_path / "run", config)
    generations = trainer.generations()
    list(islice(generations, 3))
    fail(*failure)
    with pytest.raises(type(failure[-1])):
        list(generations)
    copytree(tmp_path / "run", tmp_path / "copy")
    whole = uninterrupted(config)
    list(trainer.generations())
    assert snapshot(tmp_path / "run") == whole
    list(resume(tmp_path / "copy").generations())
    assert snapshot(tmp_path / "copy") == whole


def test_an_interrupt_at_any_line_costs_nothing(
    tiny: RunConfig, tmp_path: Path, start: Any, snapshot: Any, uninterrupted: Any
) -> None:
    package, whole = str(Path(esp_trainer.__file__).parent), uninterrupted(tiny)

    def interrupted_at(line: int, path: Path) -> int:
        """The lines of generation 3, of which one raises."""
        trainer, lines = start(path, tiny, threads=1), 0

        def trace(frame: FrameType, event: str, _: Any) -> Any:
            nonlocal lines
            if not frame.f_code.co_filename.startswith(package):
                return None
            if event == "line":
                lines += 1
                if lines == line:
                    sys.settrace(None)
                    raise KeyboardInterrupt
            return trace

        generations = trainer.generations()
        list(islice(generations, 3))
        before = sys.gettrace()
        sys.settrace(trace)
        try:
            next(generations)
        except KeyboardInterrupt:
            pass
        finally:
            sys.settrace(before)
        list(trainer.generations())
        return lines

    n_lines = interrupted_at(0, tmp_path / "never")
    assert n_lines > 300
    for line in range(1, n_lines, 97):  # every line was tried once; it takes minutes
        interrupted_at(line, tmp_path / str(line))
        assert snapshot(tmp_path / str(line)) == whole, line


def test_who_breaks_out_of_the_loop_goes_on_with_the_lock(
    tiny: RunConfig, tmp_path: Path, start: Any, resume: Any, snapshot: Any, uninterrupted: Any
) -> None:
    trainer = start(tmp_path / "run", tiny)
    assert [generation.number for generation in islice(trainer.generations(), 3)] == [0, 1, 2]
    seen = []
    for generation in trainer.generations():
        seen.append(generation.number)
        with pytest.raises(BlockingIOError, match=r"is in use by another process or trainer$"):
            resume(tmp_path / "run")
    assert seen == [3, 4, 5]
    assert snapshot(tmp_path / "run") == uninterrupted(tiny)
    assert resume(tmp_path / "run").done == 6  # the lock is free again


def test_a_loop_that_a_notebook_still_holds_ends_when_another_begins(
    tiny: RunConfig, tmp_path: Path, start: Any, snapshot: Any, uninterrupted: Any
) -> None:
    trainer = start(tmp_path / "run", tiny)
    held = trainer.generations()
    next(held)
    assert [generation.number for generation in trainer.generations()] == [1, 2, 3, 4, 5]
    assert list(held) == []
    assert snapshot(tmp_path / "run") == uninterrupted(tiny)


def test_who_stopped_goes_on(tiny: RunConfig, tmp_path: Path, start: Any, snapshot: Any, uninterrupted: Any) -> None:
    trainer = start(tmp_path / "run", tiny)
    for generation in trainer.generations():
        if generation.number == 2:
            trainer.stop()
    assert trainer.done == 3
    for _ in trainer.generations():  # once more, with a break
        trainer.stop()
        break
    assert [generation.number for generation in trainer.generations()] == [4, 5]
    assert snapshot(tmp_path / "run") == uninterrupted(tiny)


def test_who_stops_before_the_loop_ends_it_at_once(tiny: RunConfig, tmp_path: Path, start: Any) -> None:
    trainer = start(tmp_path, tiny)
    trainer.stop()
    assert list(trainer.generations()) == []
    assert len(list(trainer.generations())) == 6


def test_a_trainer_whose_run_went_on_without_it_refuses(
    tiny: RunConfig, tmp_path: Path, start: Any, resume: Any, snapshot: Any, uninterrupted: Any
) -> None:
    trainer = start(tmp_path / "run", tiny)
    list(islice(trainer.generations(), 2))
    list(islice(resume(tmp_path / "run").generations(), 3))
    with pytest.raises(ValueError, match=r"left it after 2 generations: go on by Trainer.resume$"):
        list(trainer.generations())
    list(resume(tmp_path / "run").generations())
    assert snapshot(tmp_path / "run") == uninterrupted(tiny)


def test_a_copy_of_a_trainer_does_not_hold_the_lock_and_does_not_take_it_away(
    tiny: RunConfig, tmp_path: Path, start: Any, resume: Any
) -> None:
    trainer = start(tmp_path, tiny)
    generations = trainer.generations()
    next(generations)
    for copy in (deepcopy(trainer), pickle.loads(pickle.dumps(trainer))):
        assert copy.done == 1
        with pytest.raises(BlockingIOError):
            next(copy.generations())
        del copy
    with pytest.raises(BlockingIOError):
        resume(tmp_path)
    assert len(list(generations)) == 5


def test_trainers_of_one_directory_object_keep_each_other_out(
    tiny: RunConfig, tmp_path: Path, snapshot: Any, uninterrupted: Any
) -> None:
    directory = RunDirectory(tmp_path / "run")
    first = Trainer.start(directory, tiny, _evaluator)
    list(islice(first.generations(), 3))
    second = Trainer.resume(directory, _evaluator)
    with pytest.raises(BlockingIOError):
        list(first.generations())
    assert len(list(second.generations())) == 4  # from the checkpoint of two
    with pytest.raises(ValueError, match="no longer as this trainer left it after 3 generations"):
        list(first.generations())
    assert snapshot(tmp_path / "run") == uninterrupted(tiny)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="Windows cannot fork")
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork:DeprecationWarning")
def test_a_fork_of_a_trainer_does_not_play_beside_it(
    tiny: RunConfig, tmp_path: Path, start: Any, snapshot: Any, uninterrupted: Any
) -> None:
    trainer = start(tmp_path / "run", tiny)
    child = os.fork()
    if child == 0:
        try:
            next(trainer.generations())
        except BlockingIOError:
            os._exit(0)
        os._exit(1)
    assert os.waitpid(child, 0)[1] == 0
    list(trainer.generations())
    assert snapshot(tmp_path / "run") == uninterrupted(tiny)


def test_who_goes_on_after_a_break_leaves_the_champions_of_the_checkpoint(
    tiny: RunConfig, tmp_path: Path, start: Any
) -> None:
    """A hall of three keeps 0, 1 and 2 after three generations, and 0, 2 and 3 after four."""
    trainer = start(tmp_path, tiny.replace(checkpoint_every=3, esp=tiny.esp.replace(hof_size=3)))
    list(islice(trainer.generations(), 4))
    next(trainer.generations())
    assert trainer.directory.champion_generations("prey") == [0, 1, 2, 3, 4]


def test_a_side_that_was_replaced_by_a_script_goes_on_after_a_break(
    tiny: RunConfig, tmp_path: Path, start: Any
) -> None:
    trainer = start(tmp_path, tiny)
    trainer.coevolution.sides["prey"] = ScriptedTeams("random")
    list(islice(trainer.generations(), 3))
    assert [generation.number for generation in trainer.generations()] == [3, 4, 5]


def test_an_interrupt_while_a_run_is_begun_leaves_nothing(
    tiny: RunConfig, tmp_path: Path, start: Any, fail: Any
) -> None:
    fail(RunDirectory, "write_config", 1, False, CTRL_C)
    with pytest.raises(KeyboardInterrupt):
        start(tmp_path / "run", tiny)
    assert not (tmp_path / "run").exists()
    assert len(list(start(tmp_path / "run", tiny).generations())) == 6


def test_a_second_thread_is_told_that_the_first_is_at_work(tiny: RunConfig, tmp_path: Path, start: Any) -> None:
    trainer = start(tmp_path, tiny)
    told: list[str] = []

    def ask() -> None:
        try:
            trainer.generations()
        except BlockingIOError as error:
            told.append(str(error))

    def evaluate_and_ask(batch: Any) -> Any:
        thread = threading.Thread(target=ask, daemon=True)
        thread.start()
        join(thread)
        return FusedEvaluator.evaluate(trainer.coevolution.evaluator, batch)

    trainer.coevolution.evaluator.evaluate = evaluate_and_ask
    next(trainer.generations())
    assert set(told) == {f"{tmp_path} is in use by another thread"}
