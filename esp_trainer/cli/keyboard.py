"""Keyboard input from a terminal while a command draws on it."""

from __future__ import annotations

import os
import select
import sys
import time
from contextlib import suppress
from types import TracebackType

try:
    import termios
    import tty
except ImportError:  # Windows
    termios = None  # type: ignore[assignment]


class Keyboard:
    """A context manager that reads keys as they are pressed, without echoing them.

    Without a terminal no key is read, and :meth:`pressed` only waits.
    """

    def __init__(self) -> None:
        self._descriptor = sys.stdin.fileno() if _is_ours() else None
        self.listens = self._descriptor is not None

    def __enter__(self) -> Keyboard:
        if self._descriptor is not None:
            self._before = termios.tcgetattr(self._descriptor)
            tty.setcbreak(self._descriptor, termios.TCSANOW)  # unlike TCSAFLUSH, keeps keys that were pressed before
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._descriptor is not None:
            termios.tcsetattr(self._descriptor, termios.TCSADRAIN, self._before)

    def pressed(self, key: str, seconds: float) -> bool:
        """Wait for a key, in either case; return False if it is not pressed within ``seconds``."""
        end = time.monotonic() + seconds
        while self._descriptor is not None and (left := end - time.monotonic()) > 0:
            if not select.select([self._descriptor], [], [], left)[0]:
                return False
            byte = os.read(self._descriptor, 1)
            if byte.lower() == key.encode():
                return True
            if not byte:  # end of file: the terminal is closed
                break
        time.sleep(max(0.0, end - time.monotonic()))
        return False


def _is_ours() -> bool:
    """Return whether standard input is a terminal with this process in its foreground.

    A terminal stops a background process that reads from it.
    """
    if termios is None or not sys.stdin.isatty():
        return False
    with suppress(OSError):  # the terminal is not a controlling terminal
        return os.tcgetpgrp(sys.stdin.fileno()) == os.getpgrp()
    return True
