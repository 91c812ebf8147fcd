"""A run of thousands of generations: does it grow, or slow down?"""

from __future__ import annotations

import json
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
"""Generations at each end, whose times are compared."""
_PAUSE = 0.25  # seconds between looks


def run(
    place: Path, generations: int, told: Callable[[int], object] = lambda _: None, options: tuple[object, ...] = ()
) -> dict[str, np.ndarray]:
    """A run on one thread, watched from outside.

    Returns:
        ``generation`` and ``seconds`` of each of them; ``seen``, the generations at which memory was looked at, and
        ``megabytes``, what was resident.
    """
    seen: list[tuple[int, float]] = []
    command = ["train", PRESET, *options, "--generations", generations, "--threads", 1, "--out", "run", "--quiet"]
    with begun(command, place) as process:
        while not process.wait(_PAUSE):
            done, megabytes = len(whole_lines(place / "run/timing.jsonl")), resident(process.process.pid)
            if done and megabytes:
                seen.append((done, megabytes))
                told(done)
        ended = process.ended()
    if ended.code:
        raise RuntimeError(f"the run ended with {ended.code}: {ended.said}")
    lines = [json.loads(line) for line in whole_lines(place / "run/timing.jsonl")]
    seconds = [sum(value for name, value in line.items() if name != "generation") for line in lines]
    at, megabytes_seen = zip(*seen, strict=True)
    return {
        "generation": np.arange(len(seconds)),
        "seconds": np.array(seconds),
        "seen": np.array(at),
        "megabytes": np.array(megabytes_seen),
    }


def resident(pid: int) -> float:
    """Megabytes of a process that are in memory; 0 of one that has ended."""
    try:
        lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    except (FileNotFoundError, ProcessLookupError):
        return 0
    kilobytes = [line.split()[1] for line in lines if line.startswith("VmRSS:")]
    return int(kilobytes[0]) / 1000 if kilobytes else 0


def figures(watched: dict[str, np.ndarray]) -> dict[str, Any]:
    """What can be said of it in numbers."""
    seconds, early = watched["seconds"], int(np.searchsorted(watched["seen"], EARLY))
    first, last = (1000 * float(np.median(part)) for part in (seconds[:SPAN], seconds[-SPAN:]))
    return {
        "generations": len(seconds),
        "megabytes early": round(float(watched["megabytes"][early]), 1),
        "megabytes late": round(float(watched["megabytes"][-1]), 1),
        "megabytes at most": round(float(watched["megabytes"].max()), 1),
        "milliseconds early": round(first, 2),
        "milliseconds late": round(last, 2),
        "seconds": round(float(seconds.sum()), 1),
    }


def draw(watched: dict[str, np.ndarray], path: Path) -> None:
    """Memory and time by generation."""
    figure, (memory, time) = plots.panels(2, width=4.6, columns=2)
    memory.plot(watched["seen"], watched["megabytes"], color=plots.COLOURS[0])
    memory.set(xlabel="generation", ylabel="MB resident", ylim=(0, None), title="memory")
    milliseconds = 1000 * watched["seconds"]
    time.plot(watched["generation"], milliseconds, color="0.8", linewidth=0.5)
    drawn = plots.curve(time, watched["generation"], milliseconds[None], "50 generations' mean", 1, window=50)
    time.set(
        xlabel="generation", ylabel="ms", ylim=(0, 3 * float(np.median(milliseconds))), title="time of a generation"
    )
    plots.legend(time)
    megabytes = np.interp(watched["generation"], watched["seen"], watched["megabytes"])
    plots.save(figure, path, {"generation": watched["generation"], "megabytes": megabytes, **drawn})
