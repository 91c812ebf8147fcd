"""A run of thousands of generations: does it grow, or slow down?"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from esp_trainer.analysis import plots
from esp_trainer.run.directory import whole_lines
from reliability.processes import begun

PRESET = "paper-3v2"
EARLY = 100
"""Generations after which memory is first looked at: by then everything is loaded and compiled."""
SPAN = 200
"""Generations early and at the end, whose times are compared."""
_WINDOW = 50  # generations of the running mean of CPU time
_PAUSE = 0.25  # seconds between looks


def run(
    place: Path, generations: int, told: Callable[[int], object] = lambda _: None, options: tuple[object, ...] = ()
) -> dict[str, np.ndarray]:
    """A run on one thread, watched from outside.

    Returns:
        ``generation`` and wall ``seconds`` of each of them; ``seen``, the generations behind it at each look, with the
        ``megabytes`` that were resident, and the ``cpu`` seconds spent so far.
    """
    seen: list[tuple[int, float, float]] = []
    command = ["train", PRESET, *options, "--generations", generations, "--threads", 1, "--out", "run", "--quiet"]
    with begun(command, place) as process:
        while not process.wait(_PAUSE):
            done, pid = len(whole_lines(place / "run/timing.jsonl")), process.process.pid
            megabytes, cpu = resident(pid), spent(pid)
            if done and megabytes:
                seen.append((done, megabytes, cpu))
                told(done)
        ended = process.ended()
    if ended.code:
        raise RuntimeError(f"the run ended with {ended.code}: {ended.said}")
    lines = [json.loads(line) for line in whole_lines(place / "run/timing.jsonl")]
    seconds = [sum(value for name, value in line.items() if name != "generation") for line in lines]
    looks = dict(zip(("seen", "megabytes", "cpu"), np.array(seen).T, strict=True))
    return {"generation": np.arange(len(seconds)), "seconds": np.array(seconds), **looks}


def resident(pid: int) -> float:
    """Megabytes of a process that are in memory; 0 of one that has ended."""
    try:
        lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    except (FileNotFoundError, ProcessLookupError):
        return 0
    kilobytes = [line.split()[1] for line in lines if line.startswith("VmRSS:")]
    return int(kilobytes[0]) / 1000 if kilobytes else 0


def spent(pid: int) -> float:
    """CPU seconds of a process so far; 0 of one that has ended."""
    try:
        numbers = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except (FileNotFoundError, ProcessLookupError):
        return 0
    return sum(map(int, numbers[11:13])) / os.sysconf("SC_CLK_TCK")


def figures(watched: dict[str, np.ndarray]) -> dict[str, Any]:
    """What can be said of it in numbers."""
    seconds, seen, megabytes = watched["seconds"], watched["seen"], watched["megabytes"]
    spans = {"early": (EARLY, EARLY + SPAN), "late": (len(seconds) - SPAN, len(seconds))}
    found = {"generations": len(seconds), "seconds": round(float(seconds.sum()), 1)}
    for when, (first, last) in spans.items():
        cpu = float(np.diff(np.interp((first, last), seen, watched["cpu"]))[0])
        found[f"milliseconds {when}"] = round(1000 * float(np.median(seconds[first:last])), 2)
        found[f"cpu {when}"] = round(1000 * cpu / SPAN, 2)
    found["megabytes early"] = round(float(megabytes[np.searchsorted(seen, EARLY)]), 1)
    found["megabytes late"] = round(float(megabytes[-1]), 1)
    return found | {"megabytes at most": round(float(megabytes.max()), 1)}


def draw(watched: dict[str, np.ndarray], path: Path) -> None:
    """Memory and time by generation."""
    figure, (memory, time) = plots.panels(2, width=4.6, columns=2)
    memory.plot(watched["seen"], watched["megabytes"], color=plots.COLOURS[0])
    memory.set(xlabel="generation", ylabel="MB resident", ylim=(0, None), title="memory")
    generation, wall, cpu = watched["generation"], 1000 * watched["seconds"], _cpu_by_generation(watched)
    time.plot(generation, wall, color="0.8", linewidth=0.5, label="wall")
    time.plot(generation, cpu, color=plots.COLOURS[1], label=f"CPU, {_WINDOW} generations' mean")
    time.set(xlabel="generation", ylabel="ms", ylim=(0, 3 * float(np.median(cpu))), title="time of a generation")
    plots.legend(time)
    megabytes = np.interp(generation, watched["seen"], watched["megabytes"])
    plots.save(figure, path, {"generation": generation, "megabytes": megabytes, "wall ms": wall, "CPU ms": cpu})


def _cpu_by_generation(watched: dict[str, np.ndarray]) -> np.ndarray:
    """Milliseconds, mean over the generations around each, as far as they lie between two looks."""
    generation, seen = watched["generation"], watched["seen"]
    first = np.clip(generation - _WINDOW / 2, seen[0], max(seen[0], seen[-1] - _WINDOW))
    last = np.minimum(first + _WINDOW, seen[-1])
    begun_with, ended_with = (np.interp(at, seen, watched["cpu"]) for at in (first, last))
    return np.asarray(1000 * (ended_with - begun_with) / (last - first))
