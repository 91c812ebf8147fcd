"""``watch``: a run followed live, on a terminal and into a pipe."""

from __future__ import annotations

import io
import os
import pty
import select
import shutil
import signal
import subprocess
import sys
import termios
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from waiting import PATIENCE, wait

from esp_trainer.cli import main
from esp_trainer.cli.keyboard import Keyboard
from esp_trainer.cli.watch import _signals, chart
from esp_trainer.run.directory import RunDirectory

COMMAND = [sys.executable, "-m", "esp_trainer"]


def test_a_chart_is_columns_of_eighths() -> None:
    assert chart(np.array([0.0, 0.125, 0.5, 1.0]), width=10, height=1) == [" ▁▄█"]
    assert chart(np.array([0.25, 0.75]), width=10, height=2) == [" ▄", "▄█"]
    assert chart(np.array([0.0, 1.0, 1.0, 1.0]), width=2, height=1) == ["▄█"]  # means of two each


def test_signals_are_means_over_the_recent_generations() -> None:
    def line(signal: float | None, ties: float) -> dict[str, Any]:
        return {"subpopulations": {"prey": {"diversity": 1.0, "scale": 1.0, "signal": signal, "ties": ties}}}

    told = ["0.20 signal in the selection of prey, 0.75 of its trials alike"]
    assert list(_signals([line(0.3, 0.5), line(0.1, 0.75)])) == told
    assert list(_signals([line(0.1, 0.5), line(None, 0.75)])) == []
    assert list(_signals([{"generation": 0}])) == []  # of an older log


def test_of_a_run_that_is_over_it_tells_every_generation(esp_trainer: Callable[..., Any], smoke_run: Path) -> None:
    outcome = esp_trainer("watch", smoke_run)
    assert outcome.code == 0
    lines = outcome.out.splitlines()
    n = len((smoke_run / "metrics.jsonl").read_text().splitlines())
    assert len(lines) == n
    assert lines[-1].startswith(f"generation {n}/{n}: predators succeed ")


def test_where_there_is_no_run_it_says_so(esp_trainer: Callable[..., Any], tmp_path: Path) -> None:
    assert "holds no run" in esp_trainer("watch", tmp_path / "nowhere").refusal


def test_a_directory_of_runs_is_refused_with_one_of_them(
    esp_trainer: Callable[..., Any], smoke_run: Path, tmp_path: Path
) -> None:
    run = Path(shutil.copytree(smoke_run, tmp_path / "sweep/smoke-seed0"))
    says = f"esp-trainer: {run.parent} is no run but holds some; watch one of them, such as {run}"
    assert esp_trainer("watch", run.parent).refusal == says


class Terminal(io.StringIO):
    """A stream that says that it is a terminal."""

    def isatty(self) -> bool:
        return True


def test_on_a_dumb_terminal_it_tells_lines(smoke_run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "dumb")
    monkeypatch.setattr(sys, "stdout", screen := Terminal())
    assert main(["watch", str(smoke_run)]) == 0
    lines = screen.getvalue().splitlines()
    assert [line.split(":")[0] for line in lines] == [f"generation {i + 1}/20" for i in range(20)]
    assert "\x1b" not in screen.getvalue()


def test_on_a_dumb_terminal_a_replay_follows_frame_on_frame(
    predators: Path, prey: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TERM", "dumb")
    monkeypatch.setattr(sys, "stdout", screen := Terminal())
    assert main(["replay", str(predators), "--against", str(prey), "--until", "1"]) == 0
    assert screen.getvalue().startswith("step 0/30")
    assert "\x1b" not in screen.getvalue()


# A run at which nobody is at work.


@pytest.fixture
def unfinished(smoke_run: Path, tmp_path: Path) -> Path:
    """A run of 20 generations that is to have 1000."""
    run = Path(shutil.copytree(smoke_run, tmp_path / "a run"))
    config = run / "config.json"
    config.write_text(config.read_text().replace('"generations": 20', '"generations": 1000'))
    return run


def test_of_a_run_that_nobody_does_it_says_once_how_to_go_on_and_waits(
    unfinished: Path, esp_trainer: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    waits = iter([False, False, True])
    monkeypatch.setattr(Keyboard, "pressed", lambda *_: next(waits))
    outcome = esp_trainer("watch", unfinished)
    assert outcome.code == 0
    assert len(outcome.out.splitlines()) == 20
    says = f"no process on this machine works on {unfinished}; go on with:\n  esp-trainer resume '{unfinished}'\n"
    assert outcome.err == says


def test_of_a_run_that_somebody_does_it_says_nothing_until_they_stop(
    unfinished: Path, esp_trainer: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    at_work = RunDirectory(unfinished)
    at_work.lock()
    changes = iter([lambda: False, at_work.unlock, at_work.lock, at_work.unlock, lambda: True])
    monkeypatch.setattr(Keyboard, "pressed", lambda *_: next(changes)() is True)
    assert esp_trainer("watch", unfinished).err.count("no process on this machine works on") == 2


def test_a_keyboard_reads_one_key_at_a_time_and_is_left_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    master, terminal = pty.openpty()
    before = termios.tcgetattr(terminal)
    with os.fdopen(terminal) as stdin:
        monkeypatch.setattr(sys, "stdin", stdin)
        with Keyboard() as keyboard:
            assert keyboard.listens
            assert not keyboard.pressed("q", 0.01)
            os.write(master, b"x\x1b[Aqx")
            assert keyboard.pressed("q", 60)
            assert not keyboard.pressed("q", 0.01)
        assert termios.tcgetattr(terminal) == before
    os.close(master)


@pytest.mark.parametrize("key", [b"q", b"Q"])
def test_a_key_counts_that_was_pressed_before_anybody_listened(key: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    """While Python starts, say."""
    master, terminal = pty.openpty()
    with os.fdopen(terminal) as stdin:
        monkeypatch.setattr(sys, "stdin", stdin)
        os.write(master, key)
        with Keyboard() as keyboard:
            assert keyboard.pressed("q", 1)
    os.close(master)


def test_without_a_terminal_there_are_no_keys(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO("q"))
    with Keyboard() as keyboard:
        assert not keyboard.listens
        assert not keyboard.pressed("q", 0.01)


@pytest.mark.slow
def test_it_follows_a_run_to_its_end(tmp_path: Path) -> None:
    run = tmp_path / "run"
    options = ["smoke", "--generations", "12", "--out", str(run), "--quiet"]
    with subprocess.Popen([*COMMAND, "train", *options], stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL) as train:
        wait((run / "config.json").exists)
        watched = subprocess.run(
            [*COMMAND, "watch", str(run)], capture_output=True, text=True, timeout=PATIENCE, check=True
        )
        assert train.wait(timeout=PATIENCE) == 0
    assert [line.split(":")[0] for line in watched.stdout.splitlines()] == [f"generation {i + 1}/12" for i in range(12)]


def on_a_terminal(command: list[str], enough: Callable[[str], bool]) -> tuple[str, subprocess.Popen[bytes], int]:
    """Run a command on a terminal of 100 by 30, and read until there is enough or it ends."""
    keyboard, screen = pty.openpty()
    process = subprocess.Popen(
        command, stdout=screen, stderr=screen, stdin=screen, env={**os.environ, "COLUMNS": "100", "LINES": "30"}
    )
    os.close(screen)
    return read(process, keyboard, enough), process, keyboard


def read(process: subprocess.Popen[bytes], keyboard: int, enough: Callable[[str], bool]) -> str:
    """What a command shows until there is enough or it ends: a terminal gives at most 4 KiB at a time."""
    shown = ""
    deadline = time.monotonic() + PATIENCE
    while not enough(shown) and time.monotonic() < deadline:
        if select.select([keyboard], [], [], 0.5)[0]:
            try:
                shown += os.read(keyboard, 65536).decode(errors="replace")
            except OSError:  # it has ended
                break
        elif process.poll() is not None:
            break
    return shown


@pytest.mark.slow
def test_on_a_terminal_it_draws_curves_and_a_chase(smoke_run: Path) -> None:
    shown, process, _ = on_a_terminal([*COMMAND, "watch", str(smoke_run), "--fps", "200"], lambda _: False)
    assert process.wait(timeout=PATIENCE) == 0
    n = len((smoke_run / "metrics.jsonl").read_text().splitlines())
    assert f"generation {n} of {n}" in shown
    assert f"champions of generation {n - 1}" in shown
    assert "prey caught" in shown
    assert "step 0/" in shown
    assert "│" in shown
    assert f"is complete: {n} generation" in shown


@pytest.mark.slow
@pytest.mark.parametrize(("stop", "code"), [(b"q", 0), (signal.SIGINT, 0), (signal.SIGTERM, 143)], ids=str)
def test_it_goes_when_it_is_told_to_and_leaves_the_terminal_as_it_was(
    stop: bytes | signal.Signals, code: int, unfinished: Path
) -> None:
    shown, process, keyboard = on_a_terminal([*COMMAND, "watch", str(unfinished)], lambda shown: "step 3/" in shown)
    assert "step 3/" in shown
    assert "q or Ctrl-C stops watching" in shown
    assert "no process on this machine works on" in shown
    if isinstance(stop, bytes):
        os.write(keyboard, stop)
    else:
        process.send_signal(stop)
    last = read(process, keyboard, lambda _: False)
    assert process.wait(timeout=PATIENCE) == code
    assert "Traceback" not in last
    assert last.endswith("\x1b[?1049l")  # the screen as it was before
    assert termios.tcgetattr(keyboard)[3] & termios.ICANON
