"""Processes that are really stopped: by Ctrl-C, SIGTERM, a terminal that closes, and SIGKILL at random moments."""

from __future__ import annotations

import json
import random
import shutil
import signal
import subprocess
import sys
import time
from typing import TYPE_CHECKING, Any

import pytest
from waiting import PATIENCE, wait

from esp_trainer.cli import main
from esp_trainer.esp.team import Team
from esp_trainer.files import read_arrays
from esp_trainer.presets import preset
from esp_trainer.run.checkpoint import load_checkpoint
from esp_trainer.run.directory import RunDirectory, whole_lines

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

_COMMAND = [sys.executable, "-c", "import sys; from esp_trainer.cli import main; sys.exit(main())"]
_GENERATIONS = 300
"""Of the run that is killed: more than it gets through in all its lives on a fast machine."""
_STOPPED = 100
"""Of a run that is stopped early: many times what it does in the time until the signal comes."""


def _begin(*arguments: object) -> subprocess.Popen[str]:
    command = [*_COMMAND, *map(str, arguments), "--quiet", "--threads", "2"]
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=_hear_hangups, process_group=0
    )


def _hear_hangups() -> None:
    """As in a terminal, also where the tests run under nohup."""
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


def _wait(process: subprocess.Popen[str], happened: Callable[[], bool], pause: float = 0.001) -> None:
    """Until something has happened or the process has ended."""
    wait(lambda: process.poll() is not None or happened(), pause)


def _logged(path: Path) -> int:
    return len(whole_lines(path / "metrics.jsonl"))


def _checkpointed(path: Path) -> int:
    checkpoint = path / "checkpoint.safetensors"
    return int(read_arrays(checkpoint, "checkpoint")[0]["generations"]) if checkpoint.exists() else 0


def _stop(number: signal.Signals) -> Any:
    """SIGTERM stands for the others in the tests that are not slow."""
    return pytest.param(number, marks=() if number == signal.SIGTERM else pytest.mark.slow, id=number.name)


@pytest.mark.parametrize("number", [_stop(each) for each in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)])
def test_a_signal_finishes_the_write_in_hand_and_leaves_a_run_that_resumes_to_the_same_bytes(
    number: signal.Signals, tmp_path: Path, snapshot: Any, uninterrupted: Any, resume: Any
) -> None:
    path = tmp_path / "run"
    process = _begin("train", "smoke", "--generations", _STOPPED, "--out", path)
    _wait(process, lambda: _logged(path) >= 7)
    process.send_signal(number)
    _, errors = process.communicate(timeout=PATIENCE)
    done = _logged(path)
    assert process.returncode == 128 + number
    assert errors.splitlines()[-2:] == [
        "stopping after the generation in hand; Ctrl-C now stops at once",
        f"stopped after {done} generations; go on with: esp-trainer resume {path}",
    ]
    assert "Traceback" not in errors
    assert 7 <= done < _STOPPED
    assert _checkpointed(path) == done, "a run that may finish its write loses nothing"
    assert not list(path.rglob(".*"))
    list(resume(path, done + 7).generations())
    assert snapshot(path) == uninterrupted(preset("smoke").replace(generations=done + 7))


@pytest.mark.slow
def test_more_signals_than_two_end_it_in_good_order_too(tmp_path: Path) -> None:
    path = tmp_path / "run"
    process = _begin("train", "smoke", "--generations", 3000, "--out", path)
    _wait(process, lambda: _logged(path) >= 2)
    for _ in range(5):
        process.send_signal(signal.SIGINT)
        process.send_signal(signal.SIGTERM)
    _, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode in (130, 143)
    assert "Traceback" not in errors
    assert _checkpointed(path) == _logged(path)


@pytest.mark.slow
def test_a_signal_while_the_program_gets_ready_ends_it_without_a_traceback(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Compiling for the first time takes long enough for anyone to think better of it."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cold"))
    process = _begin("train", "smoke", "--out", tmp_path / "run")
    assert process.stderr is not None
    assert "preparing" in process.stderr.readline()
    time.sleep(0.3)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert "Traceback" not in errors
    assert len(errors.splitlines()) <= 1


def test_a_run_that_another_process_has_in_hand_is_left_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two at once would write every line of the log twice."""
    path = tmp_path / "run"
    process = _begin("train", "smoke", "--generations", 2000, "--out", path)
    try:
        _wait(process, lambda: _logged(path) >= 7)
        code = main(["resume", str(path), "--generations", "40", "--quiet"])
    finally:
        process.terminate()
        process.communicate(timeout=PATIENCE)
    assert code != 0
    assert len(capsys.readouterr().err.splitlines()) == 1
    lines = (path / "metrics.jsonl").read_text().splitlines()
    assert [json.loads(line)["generation"] for line in lines] == list(range(len(lines)))


@pytest.mark.slow
def test_a_run_that_another_process_has_in_hand_can_be_read(tmp_path: Path, resume: Any) -> None:
    """By those who only look: a page of it can be made, and it can be watched; it goes on as if they were not there."""
    path = tmp_path / "run"
    process = _begin("train", "smoke", "--generations", 3000, "--out", path)
    _wait(process, lambda: _logged(path) >= 7)
    watching = subprocess.Popen([*_COMMAND, "watch", str(path)], stdout=subprocess.PIPE, text=True)
    try:
        assert watching.stdout is not None
        assert [watching.stdout.readline().split()[:2] for _ in range(3)] == [
            ["generation", f"{number}/3000:"] for number in (1, 2, 3)
        ]
        few = ["--generations", "4", "--episodes", "8"]
        assert main(["report", str(path), *few]) == 0
        assert main(["analyse", str(path), *few]) == 0
        assert process.poll() is None, "the run was over before it was read"
    finally:
        for each in (watching, process):
            each.terminate()
            each.communicate(timeout=PATIENCE)
    assert process.returncode == 128 + signal.SIGTERM
    assert (path / "report.html").read_text().rstrip().endswith("</html>")
    assert _checkpointed(path) == _logged(path) == resume(path).done


class _Victim:
    """A run of some generations that is killed again and again, and checked after each kill."""

    def __init__(self, path: Path, whole: dict[str, bytes], seed: int) -> None:
        self.path = path
        self.directory = RunDirectory(path)
        self.whole = whole
        self.config = preset("smoke").replace(generations=len(whole["metrics.jsonl"].splitlines()))
        self.random = random.Random(seed)
        self.kills: dict[str, int] = {}
        self.half_written = 0
        """Kills that left a file in the making."""

    def live(self, kind: str) -> None:
        """Begin or go on, and be killed at a moment of some kind."""
        before, known = _checkpointed(self.path), self.directory.config_file.exists()
        if known:
            process = _begin("resume", self.path)
        else:
            shutil.rmtree(self.path, ignore_errors=True)  # test_trainer.py says that this ought not to be needed
            process = _begin("train", "smoke", "--generations", self.config.generations, "--out", self.path)
        getattr(self, f"_{kind}")(process, before)
        process.kill()
        _, errors = process.communicate(timeout=PATIENCE)
        assert process.returncode == -signal.SIGKILL, f"it was killed in no time, and yet ended by itself: {errors}"
        self.kills[kind] = self.kills.get(kind, 0) + 1
        self.half_written += any(self.path.rglob(".*.part"))
        announced = [line for line in errors.splitlines() if line.startswith("going on with")]
        assert announced in ([], [f"going on with {self.path} from generation {before}"])
        self._check(before)

    def _start_up(self, process: subprocess.Popen[str], before: int) -> None:
        """While it imports, loads, compiles or plays its first trials; not much later, however fast the machine is."""
        moment = time.monotonic() + self.random.uniform(0.3, 1.2)
        _wait(process, lambda: time.monotonic() >= moment or _logged(self.path) >= before + 3)

    def _generation(self, process: subprocess.Popen[str], before: int) -> None:
        """Some generations on, anywhere in one."""
        wanted = before + self.random.randint(1, 12)
        _wait(process, lambda: _logged(self.path) >= wanted)
        time.sleep(self.random.uniform(0, 0.02))

    def _champion(self, process: subprocess.Popen[str], before: int) -> None:
        """While it writes a champion."""
        generation = before + self.random.randint(1, 8)
        name = self.directory.champion_file(self.random.choice(["predators", "prey"]), generation).name
        part, done = (self.directory.champions / name for name in (f".{name}.part", name))
        beyond = self.directory.champion_file("prey", generation + 1)
        done.unlink(missing_ok=True)  # of an earlier life
        beyond.unlink(missing_ok=True)
        _wait(process, lambda: part.exists() or done.exists() or beyond.exists(), pause=0)

    def _checkpoint(self, process: subprocess.Popen[str], before: int) -> None:
        """While it writes a checkpoint, the first or the second."""
        checkpoint = self.directory.checkpoint_file
        part = checkpoint.with_name(f".{checkpoint.name}.part")
        wanted = before + self.random.choice([4, 4, 9])
        _wait(process, lambda: _logged(self.path) >= wanted, pause=0)
        after = wanted // 5 * 5 + 6
        _wait(process, lambda: part.exists() or _logged(self.path) >= after, pause=0)

    def _check(self, before: int) -> None:
        """What is there is a part of the uninterrupted run, and a run that resumes."""
        if not self.directory.config_file.exists():
            return
        assert self.directory.config_file.read_bytes() == self.whole["config.json"]
        done, every = 0, self.config.checkpoint_every
        if self.directory.checkpoint_file.exists():
            _, done = load_checkpoint(self.directory.checkpoint_file, self.config)
        logged = b"".join(whole_lines(self.directory.metrics_file))
        assert self.whole["metrics.jsonl"].startswith(logged)
        assert before <= done <= len(logged.splitlines()) <= done + every, "it loses what came since a checkpoint"
        assert done % every == 0
        for champion in self.directory.champions.glob("[!.]*"):
            assert champion.read_bytes() == self.whole[f"champions/{champion.name}"]
        for generation in range(done):
            assert Team.load(self.directory.champion_file("prey", generation)).n_agents == 2


def test_a_run_that_is_killed_ends_in_the_bytes_of_one_that_was_not(
    tmp_path: Path, snapshot: Any, uninterrupted: Any, resume: Any
) -> None:
    """Once, about a checkpoint; the slow test below does it at all moments."""
    victim = _Victim(tmp_path / "run", uninterrupted(preset("smoke").replace(generations=60)), seed=0)
    victim.live("checkpoint")
    list(resume(victim.path).generations())
    assert snapshot(victim.path) == victim.whole


@pytest.mark.slow
def test_a_run_killed_at_random_moments_ends_in_the_bytes_of_one_that_was_not(
    tmp_path: Path, snapshot: Any, uninterrupted: Any, resume: Any
) -> None:
    kinds = ["start_up", "generation"] + ["champion"] * 4 + ["checkpoint"] * 4
    random.Random(0).shuffle(kinds)
    victim = _Victim(tmp_path / "run", uninterrupted(preset("smoke").replace(generations=_GENERATIONS)), seed=0)
    for kind in kinds:
        victim.live(kind)
    assert sum(victim.kills.values()) == len(kinds)
    print(f"killed {victim.kills}; {victim.half_written} left a file half written")
    assert victim.half_written > 0, "no kill hit a write: the test aims badly"
    trainer = resume(tmp_path / "run")
    assert 20 <= trainer.done < _GENERATIONS
    trainer.directory.unlock()
    process = _begin("resume", tmp_path / "run")
    output, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0
    assert output.startswith(f"{_GENERATIONS} generations in")
    assert snapshot(tmp_path / "run") == victim.whole
