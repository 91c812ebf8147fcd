"""What only one process of this machine does at a time."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def alone(file: Path) -> Iterator[None]:
    """Wait until no other process holds a file, and hold it."""
    import fcntl  # which Windows lacks; no test that needs this runs there

    with file.open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield
