"""Clocks: CPU seconds for work, wall seconds for waiting, medians for both."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping
from typing import NamedTuple

IN_A_ROW = 4
"""Runs that count in each turn."""


class Seconds(NamedTuple):
    """What something took."""

    cpu: float
    """Of all threads of this process."""
    wall: float


def measure(work: Callable[[], object]) -> Seconds:
    """Do it once."""
    wall, cpu = time.perf_counter(), time.process_time()
    work()
    return Seconds(time.process_time() - cpu, time.perf_counter() - wall)


def side_by_side(contenders: Mapping[str, Callable[[], object]], repetitions: int) -> dict[str, Seconds]:
    """Return the median seconds of each.

    They take turns, so that a machine that slows down for a while slows all of them. In its turn each runs several
    times in a row, as generations follow each other, and all but the first count: that one finds caches full of what
    the one before it left, and perhaps a sleeping core.
    """
    taken: dict[str, list[Seconds]] = {name: [] for name in contenders}
    for _ in range(repetitions):
        for name, work in contenders.items():
            work()
            taken[name] += [measure(work) for _ in range(IN_A_ROW)]
    return {
        name: Seconds(statistics.median(s.cpu for s in seconds), statistics.median(s.wall for s in seconds))
        for name, seconds in taken.items()
    }
