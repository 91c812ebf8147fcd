"""The standard streams as commands need them: open, for every character, and no reason to end a run."""

from __future__ import annotations

import codecs
import os
import sys
import threading
import warnings
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any, TextIO, cast

_PLAIN = str.maketrans(
    {
        **dict(zip("▁▂▃▄▅▆▇█", ".:-=+*%#", strict=True)),
        **dict(zip("│─┌┐└┘·…", "|-++++.~", strict=True)),
        "±": "+-",
    }
)
"""What is printed instead of characters that the encoding of a stream does not have."""


_users, _users_lock, _afterwards = 0, threading.Lock(), ExitStack()


@contextmanager
def standard_streams() -> Iterator[None]:
    """Make standard input, output and error usable in all circumstances; afterwards they are as before.

    Those that are closed are opened on the null device. Else the first file of a run would get the descriptor of
    standard error, with all that libraries write there. Characters that an encoding does not have are printed as plain
    ones, and bytes of a path that are no text as escapes, unless the stream takes such bytes. If standard error cannot
    be written, messages are lost. Warnings of our own are lines like all others.

    Threads share the streams: the first that comes makes them usable, and the last that leaves puts them back.
    """
    global _users
    with _users_lock:
        if not _users:
            _make_usable()
        _users += 1
    try:
        yield
    finally:
        with _users_lock:
            _users -= 1
            if not _users:
                _afterwards.close()


def _make_usable() -> None:
    _open_closed_descriptors()
    for name, mode in {"stdin": "r", "stdout": "w", "stderr": "w"}.items():
        if getattr(sys, name) is None:
            null = Path(os.devnull).open(mode, encoding="utf-8")  # noqa: SIM115  # closed afterwards
            _afterwards.callback(null.close)
            _afterwards.callback(setattr, sys, name, None)
            setattr(sys, name, null)
    for stream in (sys.stdout, sys.stderr):
        errors = getattr(stream, "errors", None)
        _afterwards.callback(_set_errors, stream, errors)
        _set_errors(stream, _KEEPING_BYTES if errors == "surrogateescape" else _HANDLER)
    _afterwards.callback(setattr, sys, "stderr", sys.stderr)
    sys.stderr = cast(TextIO, _Messages(sys.stderr))
    _afterwards.callback(setattr, warnings, "showwarning", warnings.showwarning)
    warnings.showwarning = partial(_show_warning, warnings.showwarning)


def _open_closed_descriptors() -> None:
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:
            null = os.open(os.devnull, os.O_RDWR)
            if null != descriptor:
                os.dup2(null, descriptor)
                os.close(null)
            os.set_inheritable(descriptor, True)  # by the workers of a sweep


def _set_errors(stream: Any, errors: str | None) -> None:
    """Choose an error handler, unless it is no stream of text in an encoding (a notebook's is not)."""
    if hasattr(stream, "reconfigure"):
        with suppress(OSError, ValueError):  # it is flushed, or closed
            stream.reconfigure(errors=errors)


def _plain(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    text = error.object[error.start : error.end].translate(_PLAIN)
    return text.encode("ascii", "backslashreplace").decode(), error.end


def _plain_or_bytes(error: UnicodeError) -> tuple[str | bytes, int]:
    """Encode bytes of a path that are no text as what they are."""
    if isinstance(error, UnicodeEncodeError):
        error.end = error.start + 1
        with suppress(UnicodeEncodeError):
            return codecs.lookup_error("surrogateescape")(error)
    return _plain(error)


_HANDLER, _KEEPING_BYTES = "esp_trainer.plain", "esp_trainer.plain_or_bytes"
codecs.register_error(_HANDLER, _plain)
codecs.register_error(_KEEPING_BYTES, _plain_or_bytes)


def _show_warning(others: Callable[..., None], message: Warning | str, *where: Any) -> None:
    """Print a warning of our packages, which names no line of source, as any other line of ours."""
    _, file, *_ = where
    if file in ("predprey_env", "esp_trainer"):
        print(f"esp-trainer: {message}", file=sys.stderr, flush=True)
    else:
        others(message, *where)


class _Messages:
    """Standard error. A full disk, or a reader or terminal that has gone, costs the messages and not the run."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> None:
        """Write, or lose what is written."""
        try:
            self._stream.write(text)
        except OSError:
            let_go(self._stream)

    def flush(self) -> None:
        """Write what is buffered, or lose it."""
        let_go(self._stream)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def is_screen(stream: TextIO) -> bool:
    """Whether a stream is a terminal on which one can draw over what is there."""
    return stream.isatty() and os.environ.get("TERM", "").lower() not in ("dumb", "unknown")


def let_go(stream: TextIO) -> None:
    """If nobody takes what is still to print, drop it; else Python complains about it when it ends."""
    try:
        stream.flush()
    except OSError:
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, stream.fileno())
        os.close(null)
