"""Windows open where nobody sees them, Ctrl-C is heard, NumPy has one thread, and clusters follow one another."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import gettempdir

import pytest

os.environ["SDL_VIDEODRIVER"] = "dummy"
# The tests run in a process for each core, where more threads of NumPy's linear algebra only wait for each other:
# ratings of the zoo take ten times as long. NumPy asks when it is loaded, after this.
os.environ["OPENBLAS_NUM_THREADS"] = "1"
# A shell that starts the tests in the background has it ignored, by all that they start too.
signal.signal(signal.SIGINT, signal.default_int_handler)


@contextmanager
def _only_cluster() -> Iterator[None]:
    """Wait until no other test on this machine has a cluster: they look for all of Ray's processes."""
    import fcntl  # which Windows lacks, and Ray's clusters of several nodes too

    with (Path(gettempdir()) / "predprey-esp-cluster.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


@pytest.fixture
def only_cluster() -> Iterator[None]:
    """No other cluster of the tests during a test."""
    with _only_cluster():
        yield


@pytest.fixture(scope="module")
def only_cluster_of_module() -> Iterator[None]:
    """No other cluster of the tests during those of a module."""
    with _only_cluster():
        yield
