"""Keys that are pressed on a terminal while a command draws on it."""

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
    """Reads keys at once and shows none of them, until the ``with`` block ends. Without a terminal only time passes."""

    def __init__(self) -> None:
        self._descriptor = sys.stdin.fileno() if _is_ours() else None
        self.listens = self._descriptor is not None

    def __enter__(self) -> Keyboard:
        if self._descriptor is not None:
            self._before = termios.tcgetattr(self._descriptor)
            tty.setcbreak(self._descriptor, termios.TCSANOW)  # keys that were pressed before count
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._descriptor is not None:
            termios.tcsetattr(self._descriptor, termios.TCSADRAIN, self._before)

    def pressed(self, key: str, seconds: float) -> bool:
        """Wait for a key, small or capital; False if so many seconds pass without it."""
        end = time.monotonic() + seconds
        while self._descriptor is not None and (left := end - time.monotonic()) > 0:
            if not select.select([self._descriptor], [], [], left)[0]:
                return False
            byte = os.read(self._descriptor, 1)
            if byte.lower() == key.encode():
                return True
            if not byte:  # the terminal has gone
                break
        time.sleep(max(0.0, end - time.monotonic()))
        return False


def _is_ours() -> bool:
    """Whether standard input is a terminal, and this process in its foreground: it would stop one in the background."""
    if termios is None or not sys.stdin.isatty():
        return False
    with suppress(OSError):  # of a terminal that controls nobody
        return os.tcgetpgrp(sys.stdin.fileno()) == os.getpgrp()
    return True
