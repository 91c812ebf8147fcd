"""A sweep on a disk that is full at any page: its runs fail one by one, with the file and the reason, or it does; once
there is room the same command does what is missing.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from reliability.disk import Tally, kind
from reliability.processes import finished, succeeded
from reliability.runs import Snapshot, different, half_written, snapshot
from reliability.small_disk import small_disk

_ROOM = 16_000
_DENSE, _GROWTH = 60, 1.25  # pages up to which every number is tried, and how steps grow from there
_FILE = """preset = "smoke"
seeds = 2
[fields]
generations = 4
checkpoint_every = 2
esp.n_trials = 16
champion.n_held_out = 8
"""
_COMMAND = ["sweep", "sweep.toml", "--out", "out", "--workers", 2]


def fill(told: Callable[[], object] = lambda: None, step: int = 1) -> Tally:
    """Try it with less and then more room, until it succeeds; ``step`` is every how many sizes."""
    tally, left = Tally(), 0
    whole = _undisturbed()
    while not _succeeds(left, whole, tally):
        told()
        left = left + step if left < _DENSE else int(left * _GROWTH) + step
    tally.needed = left
    return tally


def _undisturbed() -> Snapshot:
    with TemporaryDirectory() as place:
        (Path(place) / "sweep.toml").write_text(_FILE)
        succeeded(_COMMAND, Path(place))
        return snapshot(Path(place))


def _succeeds(left: int, whole: Snapshot, tally: Tally) -> bool:
    with small_disk(_ROOM, _ROOM) as disk:
        (disk.place / "sweep.toml").write_text(_FILE)
        disk.leave_pages(left)
        ended = finished(_COMMAND, disk.place)
        disk.make_room()
        faults = []
        if ended.code:
            tally.tried += 1
            hit = {
                re.sub(r"^.*/out/", "out/", file) for file in re.findall(r"(\S+): No space left on device", ended.said)
            }
            tally.hit.update({re.sub(r"^out/smoke-[^/]*", "out/RUN", kind(file)) for file in hit})
            faults += [] if hit else [f"does not name the file and the reason: {ended.said!r}"]
            faults += [f"said {ended.said!r}"] if "Traceback" in ended.said else []
            faults += [f"{name} is left" for name in half_written(disk.place)]
        again = finished(_COMMAND, disk.place)
        faults += [f"then {again.said}"] if again.code else []
        faults += [f"{name} is not as it would have been" for name in different(snapshot(disk.place), whole)]
        tally.faults += [f"{left} pages: {fault}" for fault in faults]
    return ended.code == 0
