"""``train`` and ``resume`` as a user meets them."""

from __future__ import annotations

import fcntl
import json
import os
import pty
import re
import shlex
import struct
import subprocess
import sys
import termios
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.presets import preset
from esp_trainer.run.directory import RunDirectory

if TYPE_CHECKING:
    from collections.abc import Callable

_COMMAND = [sys.executable, "-c", "import sys; from esp_trainer.cli import main; sys.exit(main())"]
_SUCCESS = r"predators succeed \d\.\d\d, prey \d\.\d\d, caught \d\.\d\d"


def _next_commands(output: str) -> list[list[str]]:
    """The commands that a finished run proposes, as a shell splits them."""
    lines = output[output.index("next:\n") :].splitlines()[1:]
    commands = [shlex.split(line) for line in lines]
    assert all(command[0] == "esp-trainer" for command in commands)
    return [command[1:] for command in commands]


def test_train_says_where_things_are_and_they_are_there(esp_trainer: Callable[..., Any], tmp_path: Path) -> None:
    outcome = esp_trainer("train", "smoke", "--seed", "3", "--generations", "7")
    assert outcome.code == 0
    lines = outcome.out.splitlines()
    assert lines[0] == "7 generations in runs/smoke-seed3"
    assert re.fullmatch(
        r"last 7 generations, champion against champion: \d\.\d\d of the prey caught; "
        r"predators catch all in \d\.\d\d of the episodes, prey all survive in \d\.\d\d",
        lines[1],
    )
    assert lines[2].split() == ["the", "curves", "runs/smoke-seed3/metrics.jsonl"]
    assert lines[3].split() == ["the", "teams", "runs/smoke-seed3/champions/"]
    assert len((tmp_path / "runs/smoke-seed3/metrics.jsonl").read_text().splitlines()) == 7
    assert len(list((tmp_path / "runs/smoke-seed3/champions").iterdir())) == 14
    config = RunDirectory(tmp_path / "runs/smoke-seed3").read_config()
    assert config == preset("smoke").replace(seed=3, generations=7)


def test_the_figures_of_the_end_are_means_over_the_last_generations(esp_trainer: Callable[..., Any]) -> None:
    outcome = esp_trainer("train", "smoke", "--generations", "30")
    log = [json.loads(line) for line in Path("runs/smoke-seed0/metrics.jsonl").read_text().splitlines()]
    last = [line["held_out"] for line in log[-20:]]
    caught, all_caught, none_caught = (
        sum(line[name]["rate"] for line in last) / 20 for name in ("caught", "predators_succeed", "prey_succeed")
    )
    assert outcome.out.splitlines()[1] == (
        f"last 20 generations, champion against champion: {caught:.2f} of the prey caught; "
        f"predators catch all in {all_caught:.2f} of the episodes, prey all survive in {none_caught:.2f}"
    )


@pytest.mark.parametrize(
    "options",
    [
        [],
        ["--prey.policy", "flee_nearest"],
        ["--predators.policy", "greedy_chase"],
        ["--out", "my runs/it's the first"],
    ],
    ids=["both evolve", "scripted prey", "scripted predators", "a directory that needs quotes"],
)
def test_the_next_commands_that_train_prints_work(options: list[str], esp_trainer: Callable[..., Any]) -> None:
    outcome = esp_trainer("train", "smoke", "--generations", "2", *options)
    commands = _next_commands(outcome.out)
    assert [command[0] for command in commands] == ["report", "replay", "evaluate"]
    for command in commands:
        outcome = esp_trainer(*command)
        assert outcome.code == 0, outcome.err


def test_without_a_terminal_there_is_a_line_for_each_checkpoint_and_no_bar(esp_trainer: Callable[..., Any]) -> None:
    """Nor are there carriage returns, which spoil a log."""
    for options in ([], ["--quiet"]):
        outcome = esp_trainer("train", "smoke", "--generations", "12", "--out", f"run{len(options)}", *options)
        announced, *lines = outcome.err.splitlines()
        assert announced.startswith("preparing the compiled kernel")
        assert [re.sub(_SUCCESS, "...", line) for line in lines] == ["generation 5/12: ...", "generation 10/12: ..."]
        assert "\r" not in outcome.err


def test_an_option_may_come_before_the_preset(esp_trainer: Callable[..., Any]) -> None:
    outcome = esp_trainer("train", "--seed", "4", "smoke", "--generations", "1")
    assert outcome.code == 0, outcome.err
    assert outcome.out.startswith("1 generation")
    assert Path("runs/smoke-seed4").is_dir()


def test_own_options_and_fields_may_be_mixed(esp_trainer: Callable[..., Any]) -> None:
    options = ["--quiet", "--esp.past_share", "0.5", "--out", "here", "--generations=2", "--threads=1", "--seed", "9"]
    assert esp_trainer("train", "smoke", *options).code == 0
    config = RunDirectory("here").read_config()
    assert (config.esp.past_share, config.generations, config.seed) == (0.5, 2, 9)


def test_resume_goes_on_where_a_run_ended(esp_trainer: Callable[..., Any]) -> None:
    esp_trainer("train", "smoke", "--generations", "5", "--out", "run")
    outcome = esp_trainer("resume", "run", "--generations", "7")
    assert outcome.code == 0
    assert "going on with run from generation 5" in outcome.err.splitlines()
    assert outcome.out.startswith("7 generations in run\nlast 2 generations")
    for command in _next_commands(outcome.out):
        assert esp_trainer(*command).code == 0


def test_resuming_a_complete_run_says_so_and_changes_nothing(
    esp_trainer: Callable[..., Any], contents: Callable[[Path], Any], tmp_path: Path
) -> None:
    esp_trainer("train", "smoke", "--generations", "5", "--out", "run")
    before = contents(tmp_path)
    outcome = esp_trainer("resume", "run")
    assert outcome.code == 0
    assert outcome.err.splitlines() == ["run is complete: 5 generations; give --generations to go on"]
    assert contents(tmp_path) == before


@pytest.mark.parametrize("threads", ["1", "7"])
def test_threads_change_nothing(
    threads: str, esp_trainer: Callable[..., Any], contents: Callable[[Path], Any], smoke_run: Path
) -> None:
    esp_trainer("train", "smoke", "--threads", threads, "--out", "run")
    assert Path("run/metrics.jsonl").read_bytes() == (smoke_run / "metrics.jsonl").read_bytes()
    assert Path("run/checkpoint.safetensors").read_bytes() == (smoke_run / "checkpoint.safetensors").read_bytes()


@pytest.mark.parametrize(
    "command", [["train", "smoke"], ["resume", "run", "--generations", "2"]], ids=["train", "resume"]
)
def test_an_interrupt_before_the_first_generation_ends_in_one_line(
    command: list[str], esp_trainer: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(*_: Any, **__: Any) -> None:
        raise KeyboardInterrupt

    esp_trainer("train", "smoke", "--generations", "1", "--out", "run")
    monkeypatch.setattr(FusedEvaluator, "compile", interrupt)
    outcome = esp_trainer(*command)
    assert outcome.code == 130
    assert len(outcome.err.splitlines()) <= 2
    assert "Traceback" not in outcome.err


def _on_a_terminal(columns: int, *arguments: str) -> tuple[int, str]:
    """Exit code and all that a command writes to a terminal of some width."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
    environment = os.environ | {"TQDM_MININTERVAL": "0"}  # draw every generation, however fast they pass
    process = subprocess.Popen([*_COMMAND, *arguments], stdin=theirs, stdout=theirs, stderr=theirs, env=environment)
    os.close(theirs)
    written = b""
    while True:
        try:
            some = os.read(ours, 65536)
        except OSError:  # Linux's way to say that the other end is closed
            break
        if not some:
            break
        written += some
    os.close(ours)
    return process.wait(), written.decode()


def _bars(written: str) -> list[str]:
    states = [part for line in written.split("\n") for part in line.split("\r") if part.startswith("generation ")]
    return [state for state in states if "?" not in state]  # before the first generation


@pytest.mark.parametrize("columns", [80, *(pytest.param(n, marks=pytest.mark.slow) for n in (100, 160))])
def test_on_a_terminal_a_bar_shows_generation_success_rates_seconds_and_time_left(columns: int) -> None:
    code, written = _on_a_terminal(columns, "train", "smoke", "--generations", "40")
    assert code == 0
    bars = _bars(written)
    assert {int(bar.split()[1].split("/")[0]) for bar in bars} >= set(range(1, 41))
    assert bars[-1].startswith("generation 40/40 ")
    for bar in bars:
        assert len(bar) <= columns
        assert re.match(r"generation \d+/40 ", bar)
        assert re.search(r"predators \D*\d\.\d\d", bar), bar
        assert re.search(r"prey \D*\d\.\d\d", bar), bar
        assert re.search(r"\d ?s/gen", bar), bar
        assert re.search(r"\d\d:\d\d left", bar), bar
        assert " ," not in bar, bar
    assert "generation 5/40:" not in written, "lines are for logs"


def test_on_a_terminal_quiet_has_no_bar() -> None:
    code, written = _on_a_terminal(120, "train", "smoke", "--generations", "12", "--quiet")
    assert code == 0
    assert [bar.split(":")[0] for bar in _bars(written)] == ["generation 5/12", "generation 10/12"]
    assert not re.search(r"\r(?!\n)", written)
    assert "s/gen" not in written


def test_the_command_is_installed() -> None:
    command = Path(sys.executable).with_name("esp-trainer")
    done = subprocess.run([command, "presets"], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("race-3v1 ")
    assert done.stderr == ""


@pytest.mark.parametrize(
    "command", [["presets"], ["presets", "smoke"], ["train", "--help"]], ids=lambda command: " ".join(command)
)
def test_a_reader_that_goes_away_is_no_error(command: list[str]) -> None:
    """As in ``esp-trainer presets | head -1``."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    reads, writes = os.pipe()
    os.close(reads)
    done = subprocess.run(
        [*_COMMAND, *command], stdout=writes, stderr=subprocess.PIPE, text=True, check=False, env=environment
    )
    os.close(writes)
    assert done.stderr == ""


def test_a_summary_that_cannot_be_written_is_told_in_one_line(smoke_run: Path) -> None:
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    with Path("/dev/full").open("wb") as full:
        done = subprocess.run(
            [*_COMMAND, "show", str(smoke_run / "champions/prey-00000.safetensors")],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
            env=environment,
        )
    assert done.returncode != 0
    assert done.stderr.splitlines() == ["esp-trainer: No space left on device"]


def test_a_side_whose_trials_end_alike_for_long_is_warned_of_once(
    esp_trainer: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    evaluate = FusedEvaluator.evaluate

    def without_captures(self: FusedEvaluator, batch: Any) -> Any:
        result = evaluate(self, batch)
        result.fitness[..., -2:] = 25.0  # of the prey
        return result

    monkeypatch.setattr(FusedEvaluator, "evaluate", without_captures)
    outcome = esp_trainer("train", "smoke", "--generations", "30")
    (warning,) = (line for line in outcome.err.splitlines() if line.startswith("warning"))
    assert warning == (
        "warning: 100% of the trials of the prey ended alike in the last 20 generations: selection has next to "
        "nothing to choose by (disengagement)"
    )
