"""Run tests against mutants, each in a process and a copy of the project of its own."""

from __future__ import annotations

import multiprocessing
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from multiprocessing.connection import wait
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from mutants.modules import MODULES, ROOT
from mutants.session import KILLED, SURVIVED, Mutant, TestOutcome

MEMORY_LIMIT = 8 * 2**30  # bytes that the tests of a mutant may take: some ask for arrays without end
FORK = multiprocessing.get_context("fork")


class Suite(NamedTuple):
    """Tests, and how they are run."""

    files: tuple[str, ...]
    compiled: bool
    """In a process of its own with compiled rules, else in a fork with ``NUMBA_DISABLE_JIT``."""
    left_out: tuple[str, ...] = ()
    """Tests that fail in plain Python without any mutant, as they need compiled rules, or take over a second there."""
    limit: float = 600.0
    """Seconds until the tests count as failed."""


def plain(module: str) -> Suite:
    """Return the tests of a module, in plain Python."""
    return Suite(tuple(f"tests/{file}.py" for file in MODULES[module].split()), compiled=False)


def copies(place: Path, n: int) -> list[Path]:
    """Make fresh copies of what the tests read, so that nobody else ever imports a mutant."""
    made = [place / f"copy-{i}" for i in range(n)]
    for copy in made:
        shutil.rmtree(copy, ignore_errors=True)
        for name in ("predprey_env", "esp_trainer", "tests", "scripts"):
            shutil.copytree(ROOT / name, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
        shutil.copy(ROOT / "pyproject.toml", copy)
    return made


def measured(suite: Suite, copy: Path) -> Suite:
    """Return the suite without what needs compiled rules, and with a limit of five times what it takes, and 20 s."""
    if not suite.compiled:
        failed, slow = run(suite, copy)
        suite = suite._replace(left_out=(*failed, *slow))
    start = time.perf_counter()
    failed, _ = run(suite, copy)
    if failed:
        raise SystemExit(f"these tests fail without a mutant: {', '.join(failed)}")
    return suite._replace(limit=20 + 5 * (time.perf_counter() - start))


def run(suite: Suite, copy: Path) -> tuple[list[str], list[str]]:
    """Run the tests of an unchanged copy to the end; return those that failed, and those that took over a second."""
    ours, theirs = FORK.Pipe(duplex=False)
    process = FORK.Process(target=_test, args=(suite, copy, (), theirs))
    process.start()
    theirs.close()
    found: tuple[list[str], list[str]] = ours.recv() if ours.poll(suite.limit) else (["all, being too slow"], [])
    process.join(1)
    _end(process)
    return found


def outcomes(
    suite: Suite, module: str, mutants: Sequence[Mutant], places: Sequence[Path]
) -> Iterator[tuple[Mutant, TestOutcome, str]]:
    """Run the tests against each mutant until one fails, in as many processes as there are copies."""
    waiting, free = list(reversed(mutants)), list(places)
    running: dict[Any, tuple[Mutant, Path, float]] = {}
    original = (ROOT / module).read_text()
    try:
        while waiting or running:
            while waiting and free:
                mutant, copy = waiting.pop(), free.pop()
                (copy / module).write_text(mutant.source)
                process = FORK.Process(target=_test, args=(suite, copy, ["-x"]))
                process.start()
                running[process] = mutant, copy, time.monotonic() + suite.limit
            first = min(deadline for _, _, deadline in running.values())
            wait([process.sentinel for process in running], max(0.0, first - time.monotonic()))
            for process, (mutant, copy, deadline) in list(running.items()):
                late = process.is_alive() and time.monotonic() > deadline
                if process.is_alive() and not late:
                    continue
                _end(process)
                del running[process]
                (copy / module).write_text(original)
                free.append(copy)
                yield mutant, SURVIVED if process.exitcode == 0 else KILLED, "too slow" if late else "tests"
    finally:
        for process in running:
            _end(process)


def _end(process: Any) -> None:
    """Wait for a child that has ended, or kill it with whatever it started."""
    if process.is_alive() and process.pid is not None:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    process.join()


class _Watch:
    """A plugin of pytest's that knows which tests failed, and which took over a second."""

    def __init__(self) -> None:
        self.failed: list[str] = []
        self.slow: list[str] = []

    def pytest_runtest_logreport(self, report: Any) -> None:
        if report.failed:
            self.failed.append(report.nodeid)
        elif report.duration > 1:
            self.slow.append(report.nodeid)


def _test(suite: Suite, copy: Path, more: Sequence[str], answer: Any = None) -> None:
    """Run the tests in a child, and exit as pytest does."""
    os.setpgrp()
    os.chdir(copy)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_LIMIT, MEMORY_LIMIT))
    with (copy / "log.txt").open("wb") as log:
        os.dup2(log.fileno(), 1)
        os.dup2(log.fileno(), 2)
    # In this process alone, as a mutant is imported here; the slow tests too.
    arguments = [*suite.files, *["-q", "-n", "0", "-p", "no:cacheprovider", "-p", "no:faulthandler", "-m"], ""]
    arguments += [*(f"--deselect={test}" for test in suite.left_out), *more]
    if suite.compiled:
        own = {"PYTHONPATH": str(copy), "NUMBA_CACHE_DIR": str(copy / "numba"), "NUMBA_DISABLE_JIT": "0"}
        command = [sys.executable, "-B", "-m", "pytest", *arguments]
        code = subprocess.run(command, env=os.environ | own, check=False).returncode
        found: tuple[list[str], list[str]] = ["see log.txt"] * (code != 0), []
    else:
        sys.path.insert(0, str(copy))
        sys.dont_write_bytecode = True  # a mutant is often as long as its original, and made in the same second
        watch = _Watch()
        code = int(pytest.main(arguments, plugins=[watch]))
        found = watch.failed or ["see log.txt"] * (code != 0), watch.slow
        assert str(sys.modules["predprey_env"].__file__).startswith(str(copy)), "these are not the copy's modules"
    if answer is not None:
        answer.send(found)
    sys.stdout.flush()
    os._exit(code)
