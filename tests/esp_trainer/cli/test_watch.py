"""``watch``: a run followed live, on a terminal and into a pipe."""

from __future__ import annotations

import os
import pty
import select
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from esp_trainer.cli.watch import chart

COMMAND = [sys.executable, "-m", "esp_trainer"]


def test_a_chart_is_columns_of_eighths() -> None:
    assert chart(np.array([0.0, 0.125, 0.5, 1.0]), width=10, height=1) == [" ▁▄█"]
    assert chart(np.array([0.25, 0.75]), width=10, height=2) == [" ▄", "▄█"]
    assert chart(np.array([0.0, 1.0, 1.0, 1.0]), width=2, height=1) == ["▄█"]  # means of two each


def test_of_a_run_that_is_over_it_tells_every_generation(esp_trainer: Callable[..., Any], smoke_run: Path) -> None:
    outcome = esp_trainer("watch", smoke_run)
    assert outcome.code == 0
    lines = outcome.out.splitlines()
    n = len((smoke_run / "metrics.jsonl").read_text().splitlines())
    assert len(lines) == n
    assert lines[-1].startswith(f"generation {n}/{n}: predators succeed ")


def test_where_there_is_no_run_it_says_so(esp_trainer: Callable[..., Any], tmp_path: Path) -> None:
    assert "holds no run" in esp_trainer("watch", tmp_path / "nowhere").refusal


@pytest.mark.slow
def test_it_follows_a_run_to_its_end(tmp_path: Path) -> None:
    run = tmp_path / "run"
    options = ["smoke", "--generations", "12", "--out", str(run), "--quiet"]
    with subprocess.Popen([*COMMAND, "train", *options], stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL) as train:
        while not (run / "config.json").exists():
            time.sleep(0.05)
        watched = subprocess.run([*COMMAND, "watch", str(run)], capture_output=True, text=True, timeout=300, check=True)
        assert train.wait(timeout=300) == 0
    assert [line.split(":")[0] for line in watched.stdout.splitlines()] == [f"generation {i + 1}/12" for i in range(12)]


def on_a_terminal(command: list[str], enough: Callable[[str], bool]) -> tuple[str, subprocess.Popen[bytes]]:
    """Run a command on a terminal of 100 by 30, and read until there is enough or it ends."""
    keyboard, screen = pty.openpty()
    process = subprocess.Popen(
        command, stdout=screen, stderr=screen, stdin=screen, env={**os.environ, "COLUMNS": "100", "LINES": "30"}
    )
    os.close(screen)
    shown = ""
    deadline = time.monotonic() + 120
    while not enough(shown) and time.monotonic() < deadline:
        if select.select([keyboard], [], [], 0.5)[0]:
            try:
                shown += os.read(keyboard, 65536).decode(errors="replace")
            except OSError:  # it has ended
                break
        elif process.poll() is not None:
            break
    return shown, process


@pytest.mark.slow
def test_on_a_terminal_it_draws_curves_and_a_chase(smoke_run: Path) -> None:
    shown, process = on_a_terminal([*COMMAND, "watch", str(smoke_run), "--fps", "200"], lambda _: False)
    assert process.wait(timeout=60) == 0
    n = len((smoke_run / "metrics.jsonl").read_text().splitlines())
    assert f"generation {n} of {n}" in shown
    assert f"champions of generation {n - 1}" in shown
    assert "prey caught" in shown
    assert "step 0/" in shown
    assert "│" in shown
    assert f"has all its {n} generations" in shown


@pytest.mark.slow
def test_it_goes_when_it_is_told_to_and_leaves_the_terminal_as_it_was(smoke_run: Path, tmp_path: Path) -> None:
    run = Path(shutil.copytree(smoke_run, tmp_path / "run"))
    config = run / "config.json"
    n = len((run / "metrics.jsonl").read_text().splitlines())
    config.write_text(config.read_text().replace(f'"generations": {n}', '"generations": 1000'))
    shown, process = on_a_terminal([*COMMAND, "watch", str(run)], lambda shown: "step 3/" in shown)
    assert "step 3/" in shown
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=60) == 0
    assert "Traceback" not in shown
