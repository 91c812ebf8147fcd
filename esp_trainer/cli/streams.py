"""Standard streams that are always open, can print every character, and never end a run by an error."""

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
"""Replacements for characters that the encoding of a stream lacks."""


_users, _users_lock, _afterwards = 0, threading.Lock(), ExitStack()


@contextmanager
def standard_streams() -> Iterator[None]:
    """Make standard input, output and error usable in all circumstances, and restore them afterwards.

    * Closed streams are opened on the null device.
    * Characters that an encoding lacks are replaced by plain ones. Bytes of a path that are not text are printed as
      escapes, or as they are if the stream accepts such bytes.
    * If standard error cannot be written, messages are lost.
    * Warnings of our own packages are printed as ordinary lines.

    Threads share the streams: the first thread to enter makes them usable, and the last to leave restores them.
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
    # A run's first file would otherwise get the descriptor of standard error, with all that libraries write there.
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:
            null = os.open(os.devnull, os.O_RDWR)
            if null != descriptor:
                os.dup2(null, descriptor)
                os.close(null)
            os.set_inheritable(descriptor, True)  # for the workers of a sweep


def _set_errors(stream: Any, errors: str | None) -> None:
    """Set the error handler of a stream, unless it has no encoding, as in a notebook."""
    if hasattr(stream, "reconfigure"):
        with suppress(OSError, ValueError):  # reconfigure flushes, which fails if the stream is full or closed
            stream.reconfigure(errors=errors)


def _plain(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    text = error.object[error.start : error.end].translate(_PLAIN)
    return text.encode("ascii", "backslashreplace").decode(), error.end


def _plain_or_bytes(error: UnicodeError) -> tuple[str | bytes, int]:
    """Encode bytes of a path that are not text as these bytes, and other characters as :func:`_plain` does."""
    if isinstance(error, UnicodeEncodeError):
        error.end = error.start + 1
        with suppress(UnicodeEncodeError):
            return codecs.lookup_error("surrogateescape")(error)
    return _plain(error)


_HANDLER, _KEEPING_BYTES = "esp_trainer.plain", "esp_trainer.plain_or_bytes"
codecs.register_error(_HANDLER, _plain)
codecs.register_error(_KEEPING_BYTES, _plain_or_bytes)


def _show_warning(others: Callable[..., None], message: Warning | str, *where: Any) -> None:
    """Print a warning of our packages, which names no line of source, as an ordinary line of the command."""
    _, file, *_ = where
    if file in ("predprey_env", "esp_trainer"):
        print(f"esp-trainer: {message}", file=sys.stderr, flush=True)
    else:
        others(message, *where)


class _Messages:
    """A wrapper of standard error that loses messages on a full disk, or without a reader, instead of failing."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> None:
        """Write text, or discard it if it cannot be written."""
        try:
            self._stream.write(text)
        except OSError:
            let_go(self._stream)

    def flush(self) -> None:
        """Write the buffer, or discard it if it cannot be written."""
        let_go(self._stream)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def say(line: str) -> None:
    """Print a line to standard error, because standard output may be redirected to a file."""
    print(line, file=sys.stderr, flush=True)


def is_screen(stream: TextIO) -> bool:
    """Return whether a stream is a terminal that can redraw its screen."""
    return stream.isatty() and os.environ.get("TERM", "").lower() not in ("dumb", "unknown")


def let_go(stream: TextIO) -> None:
    """Flush a stream; if that fails, redirect it to the null device."""
    # Otherwise Python would print an error about the unwritten buffer when it exits.
    try:
        stream.flush()
    except OSError:
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, stream.fileno())
        os.close(null)
