"""Wait for what processes, threads and clusters do. Any test can import it: ``pythonpath`` in pyproject.toml names the
directory.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable
    from threading import Thread

PATIENCE = 900.0  # seconds: guards against hanging only, however slow and busy the machine


def wait(happened: Callable[[], Any], pause: float = 0.005) -> Any:
    """Return what ``happened()`` returns as soon as that is true; ask every ``pause`` seconds."""
    deadline = time.monotonic() + PATIENCE
    while not (result := happened()):
        assert time.monotonic() < deadline, f"nothing happened in {PATIENCE:.0f} s"
        time.sleep(pause)
    return result


def join(thread: Thread) -> None:
    """Wait for the end of a thread."""
    thread.join(PATIENCE)
    assert not thread.is_alive(), f"the thread has not ended in {PATIENCE:.0f} s"
