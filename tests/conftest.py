"""Windows open where nobody sees them, Ctrl-C is heard, NumPy has one thread, and clusters follow one another.

Pages are opened in Chromium.
"""

from __future__ import annotations

import os
import shutil
import signal
from collections.abc import Iterator
from pathlib import Path
from tempfile import gettempdir
from typing import TYPE_CHECKING

import pytest
from alone import alone

if TYPE_CHECKING:
    from playwright.sync_api import Browser

os.environ["SDL_VIDEODRIVER"] = "dummy"
# What tests start is of this checkout too, and shares its machine code.
_CHECKOUT = str(Path(__file__).parents[1])
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [_CHECKOUT, os.environ.get("PYTHONPATH")]))
# The tests run in a process for each core, where more threads of NumPy's linear algebra only wait for each other:
# ratings of the zoo take ten times as long. NumPy asks when it is loaded, after this.
os.environ["OPENBLAS_NUM_THREADS"] = "1"
# A shell that starts the tests in the background has it ignored, by all that they start too.
signal.signal(signal.SIGINT, signal.default_int_handler)


# Tests with a cluster look for all of Ray's processes on this machine.
_CLUSTER = Path(gettempdir()) / "predprey-esp-cluster.lock"


@pytest.fixture
def only_cluster() -> Iterator[None]:
    """No other cluster of the tests during a test."""
    with alone(_CLUSTER):
        yield


@pytest.fixture(scope="module")
def only_cluster_of_module() -> Iterator[None]:
    """No other cluster of the tests during those of a module."""
    with alone(_CLUSTER):
        yield


# Chromium's own business with the network and the graphics card is switched off.
_FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update"]


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """Chromium: of the system, or the one that ``playwright install chromium`` brings. CI must have one."""
    from playwright.sync_api import Error, sync_playwright

    # The first has no windows to draw, and takes half the time.
    names = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome", "chrome")
    installed = next(filter(None, map(shutil.which, names)), None)
    with sync_playwright() as playwright:
        try:
            found = playwright.chromium.launch(executable_path=installed, args=_FLAGS)
        except Error as error:
            if os.environ.get("CI"):
                raise
            pytest.skip(f"no Chromium to open pages in: {str(error).splitlines()[0]}")
        yield found
        found.close()
