"""Work that only one process does at a time."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from time import monotonic, sleep
from typing import BinaryIO

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

PATIENCE = 120.0  # seconds to wait for another process, which may have been stopped


@contextmanager
def alone(path: Path, work: int) -> Iterator[None]:
    """Let one process at a time do a piece of work, while others that want to do the same wait.

    Args:
        path: A file that these processes share; it is made if it is not there, and stays empty.
        work: Number of the piece of work, below 2^31. A process locks the byte with this number in the file.

    The system releases the lock when the process ends. Where files cannot be locked nobody waits, so this spares work
    and protects nothing.
    """
    with ExitStack() as stack:
        with suppress(OSError):
            _wait_for(stack.enter_context(path.open("ab")), work)
        yield


def _wait_for(file: BinaryIO, byte: int) -> None:
    """Lock a byte of a file, or give up after :data:`PATIENCE` seconds."""
    end = monotonic() + PATIENCE
    while fcntl and monotonic() < end:
        try:
            fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, byte)
            return
        except (BlockingIOError, PermissionError):  # another process has it
            sleep(0.05)
