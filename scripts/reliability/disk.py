"""A disk that is full at any page, at any file, or read-only: every command says so in one line, spoils nothing, and
does its work once there is room.
"""

from __future__ import annotations

import re
import shutil
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from reliability.processes import Ended, finished, succeeded
from reliability.runs import Snapshot, below, check_run, different, grows, half_written, snapshot
from reliability.small_disk import SmallDisk, small_disk
from reliability.writes import Write

_ROOM = 16_000  # pages and names of a disk with room for everything
_GROWTH = 1.25
_REASONS = "No space left on device|Read-only file system"


@dataclass
class Tally:
    """What came of a command on disks without room."""

    tried: int = 0
    """Disks on which it failed."""
    hit: Counter[str] = field(default_factory=Counter)
    """The files at which it did."""
    needed: int = 0
    """Pages, or names, with which it no longer failed."""
    faults: list[str] = field(default_factory=list)
    """All that ought not to be."""

    def as_dict(self) -> dict[str, Any]:
        """As JSON has it."""
        return vars(self) | {"hit": dict(sorted(self.hit.items()))}


@dataclass(frozen=True)
class Shortage:
    """What a disk may be short of."""

    name: str
    cause: Callable[[SmallDisk, int], None]
    sizes: Callable[[Write], Iterator[int]]
    """How much is left of it, in the order of the attempts."""


def _pages(write: Write) -> Iterator[int]:
    left = 0
    while left < _ROOM:
        yield left
        left = left + 1 if left < write.dense else int(left * _GROWTH) + 1


SHORTAGES = {
    "pages": Shortage("pages", SmallDisk.leave_pages, _pages),
    "names": Shortage("names", SmallDisk.leave_names, lambda _: iter(range(_ROOM))),
    "read-only": Shortage("read-only", lambda disk, _: disk.seal(), lambda _: iter((0,))),
}


def fill(
    write: Write, before: Path, shortage: Shortage, told: Callable[[], object] = lambda: None, step: int = 1
) -> Tally:
    """Try a command with less and then more left of something, until it succeeds.

    Args:
        write: The command.
        before: A directory with what lies there before.
        shortage: What the disk is short of.
        told: Called after each attempt.
        step: Every how many sizes is tried.
    """
    tally, whole = Tally(), _undisturbed(write, before)
    for number, left in enumerate(shortage.sizes(write)):
        if number % step:
            continue
        if _succeeds(write, before, shortage, left, whole, tally):
            tally.needed = left
            break
        told()
    return tally


def _undisturbed(write: Write, before: Path) -> Snapshot:
    with small_disk(_ROOM, _ROOM) as disk:
        shutil.copytree(before, disk.place, dirs_exist_ok=True)
        succeeded(write.command, disk.place)
        return snapshot(disk.place)


def _succeeds(write: Write, before: Path, shortage: Shortage, left: int, whole: Snapshot, tally: Tally) -> bool:
    """Whether the command does its work with so much left; what went wrong otherwise goes into the tally."""
    with small_disk(_ROOM, _ROOM) as disk:
        shutil.copytree(before, disk.place, dirs_exist_ok=True)
        shortage.cause(disk, left)
        ended = finished(write.command, disk.place)
        disk.make_room()
        faults: list[str] = []
        if ended.code:
            tally.tried += 1
            faults += [*_said(ended, tally), *_spoilt(disk.place, snapshot(before), whole)]
        # In any case: what needs no room does without what it would have kept.
        begun = (disk.place / "run/config.json").exists()
        again = finished(write.again if write.again and begun else write.command, disk.place)
        faults += [f"then {again.said}"] if again.code else []
        found = snapshot(disk.place)
        faults += [f"{name} is not as it would have been" for name in different(found, whole)]
        tally.faults += [f"{left} {shortage.name}: {fault}" for fault in faults]
    return ended.code == 0


def _said(ended: Ended, tally: Tally) -> Iterator[str]:
    """What is wrong with the line with which it gave up; the file in it goes into the tally."""
    if ended.excuse:
        yield ended.excuse
        return
    match = re.fullmatch(rf"esp-trainer: (?:cannot write )?(.+): (?:{_REASONS})", ended.errors[0])
    if match is None:
        yield f"does not name the file and the reason: {ended.errors[0]}"
    else:
        tally.hit[kind(match[1])] += 1


def kind(file: str) -> str:
    """A file's name, the same for all champions, and for all that TensorBoard reads."""
    return re.sub(r"(champions|tensorboard)/.*", r"\1/*", file)


def _spoilt(place: Path, before: Snapshot, whole: Snapshot) -> Iterator[str]:
    """What is neither as it was before nor as it is when all is done, nor a run's file on its way there."""
    found = snapshot(place)
    yield from (f"{name} is left" for name in half_written(place))
    run_begun = (place / "run/config.json").exists()
    if run_begun:
        try:
            check_run(place / "run", below(whole, "run"))
        except (AssertionError, ValueError) as error:
            yield str(error)
    for name in {**before, **found}:
        if not (run_begun and grows(name)) and found.get(name) not in (before.get(name), whole.get(name)):
            yield f"{name} is {'gone' if name not in found else 'half written'}"
