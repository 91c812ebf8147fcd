"""How many cores this process may use: what an affinity mask and a container's CPU quota leave of the machine."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path, PurePosixPath

_GROUPS = Path("/sys/fs/cgroup")
_MEMBERSHIP = Path("/proc/self/cgroup")


def cores() -> int:
    """Return the number of cores, at least 1; a quota that is no whole number counts as the next one."""
    available = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, min([available, *(math.ceil(quota) for quota in _quotas())]))


def _quotas() -> Iterator[float]:
    """The CPU quotas of this process's control groups, in cores; none where there are no such groups, or no limit."""
    for controllers, group in _memberships():
        for place in (group, *group.parents):  # a group has no more than the groups around it
            folder = _GROUPS / controllers / place.relative_to("/")
            with suppress(OSError, ValueError):
                if controllers:  # version 1; a quota of -1 is none
                    quota, period = (int((folder / f"cpu.cfs_{name}_us").read_text()) for name in ("quota", "period"))
                else:  # version 2; "max" is none
                    quota, period = map(int, (folder / "cpu.max").read_text().split())
                if quota > 0 and period > 0:
                    yield quota / period


def _memberships() -> Iterator[tuple[str, PurePosixPath]]:
    """For each hierarchy that can limit the CPU: its folders, empty for version 2, and the group of this process."""
    with suppress(OSError, ValueError):
        for line in _MEMBERSHIP.read_text().splitlines():
            _, controllers, group = line.split(":", 2)
            if not controllers or "cpu" in controllers.split(","):
                # The folder may name the controllers in another order, with a link from each.
                yield from ((folder, PurePosixPath("/", group)) for folder in {controllers, controllers and "cpu"})
