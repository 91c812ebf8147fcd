"""Whole generations of the trainer by phase, and its process: memory, the first generation cold and warm, imports."""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from bench.page import Row, at_least
from bench.workload import PRESET, QUICK, TrainerScale, config_of
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.presets import preset
from esp_trainer.run.directory import RunDirectory
from esp_trainer.run.trainer import Trainer

_TRAINER = "import sys; from esp_trainer.cli import main; sys.exit(main())"
_PEAK = "import resource, subprocess, sys; subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL); "
_PEAK += "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"


def phase_rows(scale: TrainerScale) -> list[Row]:
    """Return the wall seconds of a generation, by phase, with a thread for each core."""
    seconds = _mean_seconds(scale)
    whole = seconds.pop("whole")
    seconds["rest"] = whole - sum(seconds.values())
    around = (whole - seconds["trials"] - seconds["held_out"]) / whole
    overhead = around - seconds["champions"] / whole
    n_generations = preset(PRESET).generations
    return [
        Row(f"a generation of `{PRESET}`, a thread for each core, mean of {scale.generations}", f"{whole:.4f} s wall"),
        *(Row(f"- {phase}", f"{taken:.4f} s wall", f"{taken / whole:.1%}") for phase, taken in seconds.items()),
        Row("champions, breeding, files and rest", "", f"{around:.1%}", "≤ 15 %", around <= 0.15),
        Row("the same without champions, whose matches are evaluation too", "", f"{overhead:.1%}"),
        Row(f"{n_generations} generations at that rate", f"{n_generations * whole / 60:.2f} min wall"),
    ]


def _mean_seconds(scale: TrainerScale) -> dict[str, float]:
    """Return the mean seconds of a generation and of its phases, the first generations left out."""
    warm = scale.warm_generations
    config = config_of(scale).replace(generations=warm + scale.generations)
    with tempfile.TemporaryDirectory() as place:
        directory = RunDirectory(Path(place) / "run")
        trainer = Trainer.start(directory, config, lambda config: FusedEvaluator(config.env))
        ends = [time.perf_counter() for _ in trainer.generations()]
        lines = [json.loads(line) for line in directory.timing_file.read_text().splitlines()[warm:]]
    phases = [phase for phase in lines[0] if phase != "generation"]
    means = {phase: statistics.fmean(line[phase] for line in lines) for phase in phases}
    return {"whole": (ends[-1] - ends[warm - 1]) / scale.generations, **means}


def process_rows(scale: TrainerScale) -> list[Row]:
    """Return what a user waits for, and the memory that a run takes."""
    with tempfile.TemporaryDirectory() as cache, tempfile.TemporaryDirectory() as runs:
        # A smoke run compiles nothing anew: that takes half a minute.
        surroundings = os.environ | ({} if scale == QUICK else {"NUMBA_CACHE_DIR": cache})

        def seconds(*command: str) -> float:
            begun = time.perf_counter()
            _run([sys.executable, *command], surroundings)
            return time.perf_counter() - begun

        first = ("-c", _TRAINER, "train", PRESET, "--quiet", "--generations")
        cold = seconds(*first, "1", "--out", str(Path(runs) / "cold"))
        warm = seconds(*first, "1", "--out", str(Path(runs) / "warm"))
        importing = min(seconds("-c", "import predprey_env") for _ in range(3))
        # Linux counts the memory of the process that starts another as the other's, so a small one starts it.
        train = [sys.executable, *first, str(scale.memory_generations), "--out", str(Path(runs) / "memory")]
        peak = int(_run([sys.executable, "-c", _PEAK, *train], surroundings)) * _UNIT / 1e6
    n = scale.memory_generations
    return [
        Row(f"`esp-trainer train {PRESET} --generations {n}`", f"{peak:.0f} MB peak", "", "< 600 MB", peak < 600),
        Row("its first generation, compiled anew", f"{cold:.1f} s wall", "", "≤ 20 s", at_least(20.0, cold)),
        Row("its first generation, from the cache", f"{warm:.2f} s wall", "", "≤ 3 s", at_least(3.0, warm)),
        Row("`import predprey_env`, with Python's start", f"{importing:.2f} s wall", "", "< 1 s", importing < 1),
    ]


_UNIT = 1 if sys.platform == "darwin" else 1024  # bytes in a unit of ru_maxrss


def _run(command: Sequence[str], surroundings: dict[str, str]) -> str:
    """Return what a command prints; its complaints are the error if it fails."""
    done = subprocess.run(command, env=surroundings, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{command[:3]} failed: {done.stderr.strip()}")
    return done.stdout
