"""Signals that ask to stop, at a chosen moment, and commands in threads that can hear none."""

from __future__ import annotations

import fcntl
import os
import pty
import signal
import struct
import sys
import termios
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from waiting import join

from esp_trainer.cli import main
from esp_trainer.cli.signals import handled_by
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.run.checkpoint import load_checkpoint
from esp_trainer.run.directory import RunDirectory, whole_lines

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

INT, TERM, HUP = signal.SIGINT, signal.SIGTERM, signal.SIGHUP
CALLS = 3  # of an evaluator in a generation: trials, candidates, held-out starts
COMMAND = [sys.executable, "-c", "import sys; from esp_trainer.cli import main; sys.exit(main())"]


@pytest.fixture
def heard() -> Iterator[None]:
    """Hangups are heard, also where the tests run under nohup."""
    before = signal.signal(HUP, signal.SIG_DFL)
    yield
    signal.signal(HUP, before)


@pytest.fixture
def send(monkeypatch: pytest.MonkeyPatch, heard: None) -> Callable[..., None]:
    """``send(numbers, generation)``: these signals come while a generation's trials are played."""
    evaluate, calls = FusedEvaluator.evaluate, iter(range(1000))

    def arm(numbers: list[signal.Signals], generation: int) -> None:
        def evaluate_and_send(self: FusedEvaluator, batch: Any) -> Any:
            if len(batch.starts) and next(calls) == CALLS * generation:
                for number in numbers:
                    os.kill(os.getpid(), number)
            return evaluate(self, batch)

        monkeypatch.setattr(FusedEvaluator, "evaluate", evaluate_and_send)

    return arm


@pytest.mark.parametrize(
    ("numbers", "done"),
    [
        *(([INT], 8), ([TERM], 8), ([HUP], 8), ([HUP, HUP, TERM], 8), ([INT, TERM, HUP], 8)),
        *(([INT, INT], 7), ([HUP, INT], 7), ([INT, INT, INT], 7)),
    ],
    ids=lambda value: "-".join(n.name for n in value) if isinstance(value, list) else None,
)
def test_the_first_signal_waits_for_the_generation_and_an_interrupt_after_it_does_not(
    numbers: list[signal.Signals], done: int, esp_trainer: Any, send: Any, smoke_run: Path, contents: Any
) -> None:
    send(numbers, generation=7)
    outcome = esp_trainer("train", "smoke", "--out", "run", "--quiet")
    assert outcome.code == 128 + numbers[0]
    assert outcome.err.splitlines()[-1] == f"stopped after {done} generations; go on with: esp-trainer resume run"
    assert len(whole_lines(Path("run/metrics.jsonl"))) == done
    assert esp_trainer("resume", "run", "--quiet").err.splitlines()[-4] == f"going on with run from generation {done}"
    for name in ("metrics.jsonl", "checkpoint.safetensors", "champions/prey-00019.safetensors"):
        assert Path("run", name).read_bytes() == (smoke_run / name).read_bytes()


def test_the_first_signal_is_acknowledged_at_once(send: Any, capfd: pytest.CaptureFixture[str], heard: None) -> None:
    send([INT], generation=2)
    assert main(["train", "smoke", "--out", "run", "--quiet"]) == 130
    assert capfd.readouterr().err.splitlines()[-2:] == [
        "stopping after the generation in hand; Ctrl-C now stops at once",
        "stopped after 3 generations; go on with: esp-trainer resume run",
    ]


def test_a_hangup_that_nohup_ignores_stays_ignored(esp_trainer: Any, send: Any) -> None:
    signal.signal(HUP, signal.SIG_IGN)
    send([HUP], generation=2)
    assert esp_trainer("train", "smoke", "--generations", "5", "--quiet").code == 0


def test_handlers_come_back_as_they_were(heard: None) -> None:
    before = [signal.getsignal(number) for number in (INT, TERM, HUP)]
    with handled_by(lambda *_: None):
        assert [signal.getsignal(number) for number in (INT, TERM, HUP)] != before
    assert [signal.getsignal(number) for number in (INT, TERM, HUP)] == before


@pytest.mark.parametrize("command", ["train", "resume", "sweep"])
def test_a_command_works_in_a_thread_other_than_the_main_one(command: str, tmp_path: Path, esp_trainer: Any) -> None:
    arguments = {
        "train": ["train", "smoke", "--generations", "2", "--out", "run", "--quiet"],
        "resume": ["resume", "run", "--generations", "3", "--quiet"],
        "sweep": ["sweep", "sweep.toml", "--workers", "1", "--quiet"],
    }[command]
    if command == "resume":
        assert esp_trainer("train", "smoke", "--generations", "2", "--out", "run", "--quiet").code == 0
    Path("sweep.toml").write_text('preset = "smoke"\n[fields]\ngenerations = 2\n')
    codes: list[int] = []
    thread = threading.Thread(target=lambda: codes.append(main(arguments)), daemon=True)
    thread.start()
    join(thread)
    assert codes == [0]


def test_a_terminal_that_closes_costs_nothing(tmp_path: Path) -> None:
    """Both halves of it: the hangup, and every write to it that fails from then on."""
    run = tmp_path / "run"
    child, terminal = pty.fork()
    if child == 0:
        signal.signal(HUP, signal.SIG_DFL)
        fcntl.ioctl(0, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
        os.execv(sys.executable, [*COMMAND, "train", "smoke", "--generations", "3000", "--out", str(run)])
    while len(whole_lines(run / "metrics.jsonl")) < 7:
        os.read(terminal, 65536)
    os.close(terminal)
    _, status = os.waitpid(child, 0)
    done = len(whole_lines(run / "metrics.jsonl"))
    assert 7 <= done < 3000
    assert os.waitstatus_to_exitcode(status) == 128 + HUP
    assert load_checkpoint(run / "checkpoint.safetensors", RunDirectory(run).read_config())[1] == done
