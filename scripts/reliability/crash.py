"""``kill -9`` at random moments, until the work is done all the same; then what is on disk against what an
uninterrupted process leaves.
"""

from __future__ import annotations

import os
import random
import signal
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from reliability.processes import Process, alive, begun
from reliability.runs import different, half_written, snapshot
from reliability.victims import Victim

_SPARED = 0.2  # of the processes: or a run that needs more than a life is never done
_AT_A_WRITE = 0.3  # of the kills: at the next write from a random moment on
_NEXT_WRITE = 10  # seconds to wait for it
_WORKERS = 2  # that a sweep may lose without a run that counts as failed
_PATIENCE = 30  # seconds for those who are to end by themselves


@dataclass
class Tally:
    """What came of the kills."""

    kills: int = 0
    """That hit a living process."""
    workers: int = 0
    """Of these, how many hit a worker instead of the process that started it."""
    commands: Counter[str] = field(default_factory=Counter)
    """Which commands the others hit."""
    found: Counter[str] = field(default_factory=Counter)
    """What was on disk at the time of these."""
    cut_off: int = 0
    """Kills that left a file in the making."""
    orphaned: float = 0
    """The most seconds that workers outlived the process that started them."""
    again: int = 0
    """The most generations that had to be done again after a kill."""
    ends: int = 0
    """Times that the work was done in the end."""
    compared: int = 0
    """Files that were compared then."""
    lost: list[str] = field(default_factory=list)
    """What could not go on."""
    differing: list[str] = field(default_factory=list)
    left: list[str] = field(default_factory=list)
    """Files in the making that nobody took away."""

    def as_dict(self) -> dict[str, Any]:
        """As JSON has it."""
        return vars(self) | {"commands": dict(self.commands), "found": dict(self.found.most_common())}

    @property
    def faults(self) -> list[str]:
        """All that ought not to be."""
        return [*self.lost, *self.differing, *self.left]


def crash(victim: Victim, kills: int, seed: int, told: Callable[[], object] = lambda: None) -> Tally:
    """Kill until so many kills have hit, each time until the work is done; what is done in the end is compared."""
    tally, generator = Tally(), random.Random(seed)
    while tally.kills < kills:
        victim.renew()
        while not _lived(victim, tally, generator, kills):
            told()
        tally.ends += 1
        tally.compared += len(victim.whole)
        tally.differing += different(snapshot(victim.place), victim.whole)
        tally.left += half_written(victim.place)
    return tally


def _lived(victim: Victim, tally: Tally, generator: random.Random, kills: int) -> bool:
    """Begin or go on, and be killed unless that is over before, or is spared; whether all is done."""
    command = victim.command()
    with begun(command, victim.place) as process:
        orphans = [] if generator.random() < _SPARED else _strike(process, victim, tally, generator, kills)
        ended = process.ended()
    if ended.code != -signal.SIGKILL:
        tally.lost += [ended.said] if ended.code else []
        return True
    tally.kills += 1
    tally.commands[str(command[0])] += 1
    try:
        tally.orphaned = max(tally.orphaned, _seconds_until_gone(orphans))
        tally.found[victim.state()] += 1
        tally.cut_off += bool(half_written(victim.place))
        tally.again = max(tally.again, victim.check())
    except (AssertionError, ValueError) as error:
        tally.lost.append(str(error))
    return False


def _strike(process: Process, victim: Victim, tally: Tally, generator: random.Random, kills: int) -> list[int]:
    """Kill a process, and before that perhaps workers of it, unless it ends earlier; the workers that it leaves."""
    lost = 0
    while tally.kills < kills and not process.wait(_moment(victim, generator)):
        if generator.random() < _AT_A_WRITE:
            _wait_for_a_write(process, victim.place)
        workers = process.workers()
        if not workers or lost == _WORKERS or generator.random() < 0.5:
            process.kill()
            return workers
        os.kill(generator.choice(workers), signal.SIGKILL)
        lost += 1
        tally.workers += 1
        tally.kills += 1
    return []


def _seconds_until_gone(workers: list[int]) -> float:
    """How long workers outlive the process that started them; :class:`AssertionError` if it is too long."""
    ended = time.monotonic()
    while any(map(alive, workers)):
        assert time.monotonic() - ended < _PATIENCE, "workers outlive the process that started them"
        time.sleep(0.001)
    return time.monotonic() - ended


def _moment(victim: Victim, generator: random.Random) -> float:
    """Seconds to live: half the time it does not get ready in them; else they are few, or a run would die only once."""
    if generator.random() < 0.5:
        return generator.uniform(0, victim.start_up)
    return victim.start_up + victim.at_work * generator.uniform(0, 1) ** 2


def _wait_for_a_write(process: Process, place: Path) -> None:
    """Until a file is in the making, or for as long as that may take."""
    patience = time.monotonic() + _NEXT_WRITE
    while time.monotonic() < patience and not half_written(place) and not process.wait(0):
        pass
