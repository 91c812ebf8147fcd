"""Clocks: CPU seconds for work, wall seconds for waiting, medians for both."""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Callable, Mapping
from multiprocessing import active_children
from pathlib import Path
from typing import NamedTuple

IN_A_ROW = 4
"""Runs that count in each turn, if turns are repeated."""


class Seconds(NamedTuple):
    """Seconds that something took."""

    cpu: float
    """CPU-seconds of all threads of this process, and of the processes that it started."""
    wall: float


def measure(work: Callable[[], object]) -> Seconds:
    """Do it once."""
    wall, cpu = time.perf_counter(), cpu_seconds()
    work()
    return Seconds(cpu_seconds() - cpu, time.perf_counter() - wall)


def cpu_seconds() -> float:
    """Return the CPU seconds of this process and, on Linux, of the processes that it started and that still run."""
    return time.process_time() + sum(_cpu_seconds_of(child.pid) for child in active_children())


def _cpu_seconds_of(process: int | None) -> float:
    facts = Path(f"/proc/{process}/stat")
    if not facts.exists():
        return 0.0
    user, system = facts.read_text().rpartition(")")[2].split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


def side_by_side(contenders: Mapping[str, Callable[[], object]], repetitions: int) -> dict[str, Seconds]:
    """Return the median seconds of each.

    They take turns, so that a machine that slows down for a while slows all of them. In its turn each runs several
    times in a row, as generations follow each other, and all but the first count: that one finds caches full of what
    the one before it left, and perhaps a sleeping core. One repetition means that nobody wants to know: all run once.
    """
    taken: dict[str, list[Seconds]] = {name: [] for name in contenders}
    for _ in range(repetitions):
        for name, work in contenders.items():
            first, *others = [measure(work) for _ in range(1 + IN_A_ROW if repetitions > 1 else 1)]
            taken[name] += others or [first]
    return {
        name: Seconds(statistics.median(s.cpu for s in seconds), statistics.median(s.wall for s in seconds))
        for name, seconds in taken.items()
    }
