"""The signals that ask a command to stop: Ctrl-C, a polite kill, and a terminal that closes."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType

Handler = Callable[[int, FrameType | None], object]

_HANGUP = getattr(signal, "SIGHUP", None)  # Windows has none
_STOPPING = tuple(number for number in (signal.SIGINT, signal.SIGTERM, _HANGUP) if number is not None)


@contextmanager
def handled_by(handler: Handler) -> Iterator[None]:
    """Let a function handle the signals that ask to stop.

    In a thread other than the main one, which Python lets handle no signal, nothing changes. A hangup that is ignored,
    as nohup asks, stays ignored.
    """
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


def tell(line: str) -> None:
    """Write a line to standard error from a handler, which may have come while Python's own stream is writing."""
    with suppress(OSError, ValueError, AttributeError):  # there is no such stream, or nobody at its other end
        os.write(sys.stderr.fileno(), f"{line}\n".encode())
