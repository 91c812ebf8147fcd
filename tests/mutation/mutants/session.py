"""The mutants of a module, made by Cosmic Ray, and a file of what became of each."""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterator
from contextlib import contextmanager
from difflib import SequenceMatcher
from pathlib import Path
from typing import Any, NamedTuple

try:
    from cosmic_ray.commands.init import init
    from cosmic_ray.mutating import mutate_code
    from cosmic_ray.plugins import get_operator
    from cosmic_ray.work_db import WorkDB, use_db
    from cosmic_ray.work_item import MutationSpec, TestOutcome, WorkerOutcome, WorkResult
except ImportError:
    raise SystemExit("mutation.py: mutants are made by Cosmic Ray: pip install cosmic-ray") from None

KILLED, SURVIVED, SKIPPED = TestOutcome.KILLED, TestOutcome.SURVIVED, WorkResult(WorkerOutcome.SKIPPED)


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
