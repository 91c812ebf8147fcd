"""A worker process that ends with its parent, and is replaced by another when it dies."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable
from typing import Any

TRIES = 3
"""Number of processes lost at a job after which the job counts as failed."""


class WorkerProcess:
    """A process that runs ``serve(connection, *arguments)``, and the other end of its connection."""

    def __init__(self, serve: Callable[..., None], *arguments: Any) -> None:
        context = multiprocessing.get_context("spawn")  # a fork of a process that has threads can hang
        self.connection, theirs = context.Pipe()
        self.process = context.Process(target=_run, args=(serve, theirs, *arguments), daemon=True)
        self.process.start()
        theirs.close()  # otherwise the connection would outlive the process

    def end(self) -> int:
        """Wait until the process has ended. Return its exit code."""
        self.process.join()
        self.connection.close()
        return self.process.exitcode or 0


def _run(serve: Callable[..., None], *arguments: Any) -> None:
    for name in ("SIGINT", "SIGHUP"):  # the parent handles Ctrl-C and the closing of the terminal
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    serve(*arguments)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)  # at once: what it works on is lost or can be resumed
