"""Number of cores that this process may use, given its affinity mask and its container's CPU quota."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path, PurePosixPath

_GROUPS = Path("/sys/fs/cgroup")
_MEMBERSHIP = Path("/proc/self/cgroup")


def cores() -> int:
    """Return the number of cores, at least 1; a fractional quota is rounded up."""
    available = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, min([available, *(math.ceil(quota) for quota in _quotas())]))


def _quotas() -> Iterator[float]:
    """Yield the CPU quotas of this process's control groups, in cores; nothing if there are no groups or no limits."""
    for controllers, group in _memberships():
        for place in (group, *group.parents):  # the quota of an enclosing group limits this group too
            folder = _GROUPS / controllers / place.relative_to("/")
            with suppress(OSError, ValueError):
                if controllers:  # version 1; a quota of -1 means no limit
                    quota, period = (int((folder / f"cpu.cfs_{name}_us").read_text()) for name in ("quota", "period"))
                else:  # version 2; "max" means no limit, and is no int
                    quota, period = map(int, (folder / "cpu.max").read_text().split())
                if quota > 0 and period > 0:
                    yield quota / period


def _memberships() -> Iterator[tuple[str, PurePosixPath]]:
    """Yield each hierarchy that can limit the CPU: its folder, "" for version 2, and the group of this process."""
    with suppress(OSError, ValueError):
        for line in _MEMBERSHIP.read_text().splitlines():
            _, controllers, group = line.split(":", 2)
            if not controllers or "cpu" in controllers.split(","):
                # The folder may list the controllers in another order; each controller's name links to it.
                yield from ((folder, PurePosixPath("/", group)) for folder in {controllers, controllers and "cpu"})
