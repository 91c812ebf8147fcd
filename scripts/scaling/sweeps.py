"""Many runs: what workers of this machine and of a Ray cluster get through."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple


class Sweep(NamedTuple):
    """Runs of ``paper-3v2``, one thread each."""

    n_runs: int
    generations: int
    one: float
    """Wall seconds with one worker."""
    two: float
    """With two."""
    cluster: float
    """On a Ray cluster of this machine, its start included."""


def measure(n_runs: int, generations: int) -> Sweep:
    """The same runs by one worker, by two, and on a cluster."""
    options = (["--workers", "1"], ["--workers", "2"], ["--address", "local"])
    return Sweep(n_runs, generations, *(_seconds(n_runs, generations, each) for each in options))


def _seconds(n_runs: int, generations: int, options: list[str]) -> float:
    with TemporaryDirectory() as place:
        file = Path(place) / "sweep.toml"
        file.write_text(f'preset = "paper-3v2"\nseeds = {n_runs}\n[fields]\ngenerations = {generations}\n')
        command = [sys.executable, "-m", "esp_trainer", "sweep", str(file), "--out", str(Path(place) / "out"), *options]
        begun = time.perf_counter()
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            raise RuntimeError(f"the sweep failed: {done.stderr.strip()}")
        return time.perf_counter() - begun
