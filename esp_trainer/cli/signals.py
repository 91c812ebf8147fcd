"""Handling of the signals that ask a command to stop: Ctrl-C, SIGTERM, and the hangup of a terminal that closes."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType

Handler = Callable[[int, FrameType | None], object]

_HANGUP = getattr(signal, "SIGHUP", None)  # None on Windows
_STOPPING = tuple(number for number in (signal.SIGINT, signal.SIGTERM, _HANGUP) if number is not None)


@contextmanager
def handled_by(handler: Handler) -> Iterator[None]:
    """Let a function handle the signals that ask to stop, until the ``with`` block ends.

    A hangup that is ignored, as under nohup, stays ignored. In a thread other than the main one, nothing changes.
    """
    # Python allows signal handlers only in the main thread.
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    numbers = [n for n in _STOPPING if n != _HANGUP or signal.getsignal(n) is not signal.SIG_IGN]
    before = {number: signal.signal(number, handler) for number in numbers}
    try:
        yield
    finally:
        for number, earlier in before.items():
            signal.signal(number, signal.SIG_DFL if earlier is None else earlier)


def write_from_handler(line: str) -> None:
    """Write a line to standard error from a signal handler.

    This bypasses Python's stream, which cannot be used in a handler that interrupts a write to the same stream.
    """
    with suppress(OSError, ValueError, AttributeError):  # the stream is missing, closed, or has no reader
        os.write(sys.stderr.fileno(), f"{line}\n".encode())
