"""Locks, which let one process or trainer at a time work in a directory."""

from __future__ import annotations

import errno
import os
from contextlib import suppress
from pathlib import Path
from time import sleep
from typing import Any

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

# Errors of file systems without locks: FUSE and Lustre, and NFS for a directory or without its lock daemon.
_CANNOT_LOCK = (errno.ENOSYS, errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOTSUP, errno.EBADF, errno.EINVAL)

_MOMENT = 0.02  # seconds between two attempts


class Lock:
    """A lock that keeps other processes and trainers that ask for it out of a directory.

    On systems and file systems without locks, everybody gets the lock.

    Raises :class:`BlockingIOError` if another holder has the lock.
    """

    def __init__(self, directory: Path) -> None:
        self._process: int | None = os.getpid()
        self._descriptor: int | None = None
        if fcntl is None:
            return
        descriptor = os.open(directory, os.O_RDONLY)
        try:
            _flock(descriptor)
            self._descriptor = descriptor
        except BlockingIOError:
            raise BlockingIOError(f"{directory} is in use by another process or trainer") from None
        except OSError as error:
            if error.errno not in _CANNOT_LOCK:
                raise
        finally:
            if self._descriptor is None:
                os.close(descriptor)

    def __getstate__(self) -> dict[str, Any]:
        """Return the state of a lock that is not held, for copies and pickles."""
        return {"_process": None, "_descriptor": None}

    @property
    def held(self) -> bool:
        """Return whether this process has the lock; a fork of it has not."""
        return self._process == os.getpid()

    def release(self) -> None:
        """Release the lock."""
        held, self._process = self.held, None
        if self._descriptor is None:
            return
        if held:  # a fork's copy of the descriptor would keep the lock
            with suppress(OSError):
                fcntl.flock(self._descriptor, fcntl.LOCK_UN)
        os.close(self._descriptor)
        self._descriptor = None

    @classmethod
    def is_free(cls, directory: Path) -> bool:
        """Return whether nobody has the lock of a directory; False if this cannot be known without locks."""
        try:
            lock = cls(directory)
        except OSError:
            return False
        free = lock._descriptor is not None
        lock.release()
        return free


def _flock(descriptor: int) -> None:
    for _ in range(2):  # another process that calls is_free() holds it for a moment
        with suppress(BlockingIOError):
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return
        sleep(_MOMENT)
    fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
