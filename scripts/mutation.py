"""Mutation testing: change the rules, the fitness and the operators of ESP in one place at a time, and see which tests
notice.

    pip install cosmic-ray
    python scripts/mutation.py                  # all modules, an hour on two busy cores; then the page
    python scripts/mutation.py torus network    # some
    python scripts/mutation.py --page           # the page alone, from what was run

Cosmic Ray makes the mutants, as mutmut passes over decorated functions, and all rules are decorated. Tests meet them in
copies of the project in .mutation, in two stages: in a fork with NUMBA_DISABLE_JIT, about a second a mutant, and what
lives there and is not in scripts/mutation.toml again with compiled rules, half a minute a mutant. Tests that take over
a second in plain Python wait for the second stage. Whoever needs longer than five times what the tests need otherwise,
and 20 s, counts as killed. It forks, so it needs Linux or macOS.

Stop it as you like: what was run is in .mutation/*.sqlite, and only mutants that live are run again, as a new test may
kill them. An edited module starts anew. Those that live were read: mutation.toml says why each may.
"""

from __future__ import annotations

import argparse
import ast
import gc
import hashlib
import importlib
import multiprocessing
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
import tomllib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from difflib import SequenceMatcher
from importlib import metadata
from multiprocessing.connection import wait
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import pytest

try:
    from cosmic_ray.commands.init import init
    from cosmic_ray.mutating import mutate_code
    from cosmic_ray.plugins import get_operator
    from cosmic_ray.work_db import WorkDB, use_db
    from cosmic_ray.work_item import MutationSpec, TestOutcome, WorkerOutcome, WorkResult
except ImportError:
    raise SystemExit("mutation.py: mutants are made by Cosmic Ray: pip install cosmic-ray") from None

ROOT = Path(__file__).resolve().parents[1]
PLACE = ROOT / ".mutation"
READ = Path(__file__).with_suffix(".toml")
PAGE = ROOT / "docs" / "reliability" / "mutation.md"
MEMORY = 8 * 2**30  # bytes that the tests of a mutant may take: some ask for arrays without end
KILLED, SURVIVED, SKIPPED = TestOutcome.KILLED, TestOutcome.SURVIVED, WorkResult(WorkerOutcome.SKIPPED)
FORK = multiprocessing.get_context("fork")

# Each module, and the files in tests that are meant to hold it.
MODULES = {
    "predprey_env/rules/torus.py": "predprey_env/test_torus",
    "predprey_env/rules/dynamics.py": "predprey_env/test_dynamics predprey_env/test_parallel_env "
    "predprey_env/test_parallel_env_turns predprey_env/test_invariants",
    "predprey_env/rules/fitness.py": "predprey_env/test_fitness predprey_env/test_parallel_env_rewards",
    "predprey_env/rules/observation.py": "predprey_env/test_observation predprey_env/test_parallel_env",
    "predprey_env/rules/starts.py": "predprey_env/test_dynamics predprey_env/test_parallel_env_randomness "
    "predprey_env/test_parallel_env_errors esp_trainer/evaluation/test_starts predprey_env/test_vector_env "
    "predprey_env/test_vector_env_parity",
    "esp_trainer/esp/operators.py": "esp_trainer/esp/test_operators",
    "esp_trainer/esp/subpopulations.py": "esp_trainer/esp/test_subpopulations "
    "esp_trainer/esp/test_subpopulations_of_several_kinds",
    "esp_trainer/esp/network.py": "esp_trainer/esp/test_network esp_trainer/esp/test_teams_of_every_controller "
    "esp_trainer/esp/test_controllers_of_several_networks",
    "esp_trainer/coevolution/champions.py": "esp_trainer/coevolution/test_champions "
    "esp_trainer/coevolution/test_fixed_sides",
    "esp_trainer/coevolution/sharing.py": "esp_trainer/coevolution/test_sharing",
    "esp_trainer/coevolution/opponents.py": "esp_trainer/coevolution/test_opponents",
}
NAMES = {Path(module).stem: module for module in MODULES}
# What holds the compiled faces of the world to the plain ones, beside a module's own tests.
COMPILED = "tests/esp_trainer/evaluation/test_parity.py"
# Imported once, and found there by each fork. Nothing of the project is: that is what changes.
WARM = ("numba.extending", "numba.core.caching", "hypothesis.strategies", "scipy.stats", "pydantic", "gymnasium.vector")
WARM += ("pettingzoo.test", "matplotlib.figure")

ABOUT = """\
# Mutation testing

The tests notice {killed:,} of {counted:,} changes of one thing in the rules, operators and fitness that could be
noticed, {score:.1%}.

Made by `python scripts/mutation.py`; the docstring there says how. One thing of a module is changed at a time by Cosmic
Ray {version}, an operator, a number, a condition or a loop, and the module's own tests are run. A mutant is killed when
a test fails, or when the tests take over five times as long as otherwise, and 20 s. Not counted are mutants of
annotations, of decorators, of what errors say, of equality to identity, and those that are not Python. The score is the
share killed of the mutants that are not equivalent, which nobody could tell from the original. All that live were read,
and below is why each may. Cosmic Ray leaves out no single statement and swaps no arguments: of such mistakes the score
says nothing.
"""


class Mutant(NamedTuple):
    """A module with one thing changed."""

    job: str
    function: str
    """Where the change is, or ``module``."""
    line: str
    """What was changed, without its indentation."""
    becomes: str
    source: str
    """The whole module."""


class Reading(NamedTuple):
    """Why mutants that no test kills may live."""

    module: str
    function: str
    becomes: list[str]
    """The changed lines."""
    why: str
    equivalent: bool = True
    """Whether nobody could tell such a mutant from the original; else it is merely let live."""


class Suite(NamedTuple):
    """Tests, and how they are run."""

    files: tuple[str, ...]
    compiled: bool
    """In a process of its own with compiled rules, else in a fork with ``NUMBA_DISABLE_JIT``."""
    left_out: tuple[str, ...] = ()
    """Tests that fail in plain Python without any mutant, as they need compiled rules, or take over a second there."""
    limit: float = 600.0
    """Seconds until the tests count as failed."""


class Session:
    """The mutants of one module, and what became of each: a file of Cosmic Ray's, written after every mutant."""

    def __init__(self, module: Path, database: WorkDB) -> None:
        self.database = database
        source = module.read_text()
        if not database.num_work_items:
            init([module], database, {})
            jobs = [item.job_id for item in database.work_items if _excluded(source, item.mutations[0])]
            database.set_multiple_results(jobs, SKIPPED)
        results = dict(database.results)
        self.outcomes = {job: result.test_outcome for job, result in results.items() if result != SKIPPED}
        self.mutants = [
            _mutant(source, item.job_id, item.mutations[0])
            for item in sorted(database.work_items, key=lambda item: item.mutations[0].start_pos)
            if results.get(item.job_id) != SKIPPED
        ]

    def record(self, mutant: Mutant, outcome: TestOutcome, how: str) -> None:
        """Keep what became of a mutant, and in which words."""
        self.outcomes[mutant.job] = outcome
        self.database.set_result(mutant.job, WorkResult(WorkerOutcome.NORMAL, how, outcome, mutant.becomes))

    def those(self, *outcomes: TestOutcome | None) -> list[Mutant]:
        """Return the mutants with one of some outcomes; None stands for those that were not run."""
        return [mutant for mutant in self.mutants if self.outcomes.get(mutant.job) in outcomes]


def database_file(module: Path, place: Path) -> Path:
    """Return where it is kept what became of a module's mutants; an edited module has other mutants."""
    return place / f"{module.stem}-{hashlib.sha256(module.read_bytes()).hexdigest()[:8]}.sqlite"


@contextmanager
def session(module: Path, place: Path) -> Iterator[Session]:
    """Open the session of a module as it now is."""
    place.mkdir(parents=True, exist_ok=True)
    with use_db(database_file(module, place)) as database:
        yield Session(module, database)


def _mutant(source: str, job: str, mutation: MutationSpec) -> Mutant:
    mutated = _mutated(source, mutation)
    old, new = source.splitlines(), mutated.splitlines()
    changes = [change for change in SequenceMatcher(None, old, new).get_opcodes() if change[0] != "equal"]
    line = " ".join(text.strip() for _, first, last, _, _ in changes for text in old[first:last])
    becomes = " ".join(text.strip() for _, _, _, first, last in changes for text in new[first:last])
    return Mutant(job, mutation.definition_name or "module", line, becomes, mutated)


def _mutated(source: str, mutation: MutationSpec) -> str:
    operator = get_operator(mutation.operator_name)(**mutation.operator_args)
    return str(mutate_code(source, operator, mutation.occurrence))


def _excluded(source: str, mutation: MutationSpec) -> bool:
    """Return whether a mutant is not counted: a change of an annotation, of a decorator or of an error's words, of
    equality to identity, which is the same of small numbers, and what is not Python.
    """
    if mutation.operator_name.endswith(("_Is", "_IsNot", "/RemoveDecorator")) and "_Is_" not in mutation.operator_name:
        return True
    for node in ast.walk(ast.parse(source)):
        parts: list[Any] = [getattr(node, "annotation", None), getattr(node, "returns", None)]
        parts += [node] if isinstance(node, ast.Raise) else getattr(node, "decorator_list", [])
        for part in filter(None, parts):
            first = part.lineno, part.col_offset - isinstance(part, ast.expr)
            if first <= mutation.start_pos and mutation.end_pos <= (part.end_lineno, part.end_col_offset):
                return True
    try:
        compile(_mutated(source, mutation), "mutant", "exec")
    except SyntaxError:
        return True
    return False


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
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
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


def test(module: str, session: Session, known: Sequence[Reading], places: Sequence[Path]) -> None:
    """Run the tests of a module against those of its mutants that none has killed, in both stages."""
    suite = plain(module)
    stage(module, session, session.those(None, SURVIVED), suite, places)
    left = [mutant for mutant in session.those(SURVIVED) if not reading(module, mutant, known)]
    stage(module, session, left, suite._replace(files=(*suite.files, COMPILED), compiled=True), places)


def plain(module: str) -> Suite:
    """Return the tests of a module, in plain Python."""
    return Suite(tuple(f"tests/{file}.py" for file in MODULES[module].split()), compiled=False)


def stage(module: str, session: Session, mutants: Sequence[Mutant], suite: Suite, places: Sequence[Path]) -> None:
    """Run a suite against mutants, and say what becomes of them."""
    if not mutants:
        return
    start, n_killed, how = time.perf_counter(), 0, "compiled" if suite.compiled else "plain"
    suite = measured(suite, places[0])
    for n, (mutant, outcome, why) in enumerate(outcomes(suite, module, mutants, places), start=1):
        session.record(mutant, outcome, f"{how}: {why}")
        n_killed += outcome == KILLED
        if n % 50 == 0 or n == len(mutants):
            took = time.perf_counter() - start
            said = f"{module}, {how}: {n} of {len(mutants)}, {n_killed} killed, {took:.0f} s"
            print(said, file=sys.stderr, flush=True)


def reading(module: str, mutant: Mutant, known: Sequence[Reading]) -> Reading | None:
    """Return what was read of a mutant."""
    place = module, mutant.function
    return next(
        (read for read in known if (read.module, read.function) == place and mutant.becomes in read.becomes), None
    )


def write(known: Sequence[Reading]) -> int:
    """Write the page on all modules that were run to the end; return 1 unless what lives and what was read agree."""
    rows, lists, unread = [], {"Survived": list[str](), "Equivalent": list[str]()}, 0
    idle = {(read.module, read.function, line) for read in known for line in read.becomes}
    for module in MODULES:
        if not database_file(ROOT / module, PLACE).exists():
            idle = {line for line in idle if line[0] != module}
            continue
        with session(ROOT / module, PLACE) as of:
            if of.those(None):
                idle = {line for line in idle if line[0] != module}
                continue
            alive = [(mutant, reading(module, mutant, known)) for mutant in of.those(SURVIVED)]
            n_killed, n_equivalent = len(of.those(KILLED)), sum(bool(r and r.equivalent) for _, r in alive)
            rows.append([n_killed + len(alive), n_killed, n_equivalent, len(alive) - n_equivalent, f"`{module}`"])
        for title, equivalent in (("Survived", False), ("Equivalent", True)):
            items: dict[tuple[str, str, str], list[str]] = {}
            for mutant, read in alive:
                if bool(read and read.equivalent) == equivalent:
                    why = read.why if read else "**not read**"
                    items.setdefault((mutant.function, mutant.line, why), []).append(f"`{mutant.becomes}`")
            lines = [f"- {at}: `{line}` as {', '.join(becomes)}: {why}" for (at, line, why), becomes in items.items()]
            lists[title] += ["", f"`{module}`", "", *lines] if lines else []
        unread += sum(read is None for _, read in alive)
        idle -= {(module, mutant.function, mutant.becomes) for mutant, _ in alive}
    rows.append([*(sum(column) for column in list(zip(*rows, strict=True))[:4]), "all"])
    heads = ["module", "mutants", "killed", "equivalent", "survived", "score"]
    cells = [[name, n, killed, same, left, f"{killed / (n - same):.1%}"] for n, killed, same, left, name in rows]
    table = [f"| {' | '.join(map(str, line))} |" for line in [heads, ["---"] * len(heads), *cells]]
    n, killed, same, *_ = rows[-1]
    answer = {"killed": killed, "counted": n - same, "score": killed / (n - same)}
    parts = [ABOUT.format(version=metadata.version("cosmic-ray"), **answer), *table]
    for title, lines in lists.items():
        parts += ["", f"## {title}", *lines]
    PAGE.write_text("\n".join(parts) + "\n")
    print(f"{PAGE.relative_to(ROOT)}: {unread} mutants live and were not read", file=sys.stderr)
    for module, function, line in sorted(idle):
        print(f"{READ.name}, {module}, {function}: no such mutant lives: {line}", file=sys.stderr)
    return int(bool(unread or idle))


def main() -> int:
    """Run the mutants, and write the page."""
    parser = argparse.ArgumentParser(description="Change the rules in one place at a time, and see which tests notice.")
    parser.add_argument(
        "modules", nargs="*", metavar="MODULE", help=f"modules to change (default: all): {' '.join(NAMES)}"
    )
    parser.add_argument("--jobs", type=int, default=2, help="mutants at a time (default: 2)")
    parser.add_argument("--page", action="store_true", help="only write the page, from what was run")
    parser.add_argument("--quick", action="store_true", help="only see that everything runs; writes no page")
    options = parser.parse_args()
    if unknown := sorted(set(options.modules) - set(NAMES)):
        parser.error(f"modules must be among {', '.join(NAMES)}, got {', '.join(unknown)}")
    known = [Reading(**entry) for entry in tomllib.loads(READ.read_text())["read"]]
    if options.page:
        return write(known)
    os.environ["NUMBA_DISABLE_JIT"] = "1"  # before Numba is imported, as it asks only once
    for name in WARM:
        importlib.import_module(name)
    gc.freeze()  # pytest collects garbage at its end, and would go through all of this
    if options.quick:
        with TemporaryDirectory() as place, session(ROOT / NAMES["torus"], Path(place)) as of:
            stage(NAMES["torus"], of, of.mutants[:10], plain(NAMES["torus"]), copies(Path(place), options.jobs))
        return 0
    places = copies(PLACE, options.jobs)
    for name in options.modules or NAMES:
        with session(ROOT / NAMES[name], PLACE) as of:
            test(NAMES[name], of, known, places)
    return write(known)


if __name__ == "__main__":
    sys.exit(main())
