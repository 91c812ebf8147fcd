"""What is known of the mutants, as one Markdown page."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

from mutants.making import KILLED, SURVIVED, Mutant, Session


class Reading(NamedTuple):
    """Why mutants that no test kills may live."""

    module: str
    function: str
    becomes: tuple[str, ...]
    """The changed lines."""
    why: str
    equivalent: bool = True
    """Whether nobody could tell such a mutant from the original; else it is merely let live."""

    def is_of(self, module: str, mutant: Mutant) -> bool:
        """Whether a mutant is one of these."""
        return (module, mutant.function) == (self.module, self.function) and mutant.becomes in self.becomes


def readings(file: Path) -> list[Reading]:
    """What a file says of mutants that somebody read."""
    known = tomllib.loads(file.read_text())["read"] if file.exists() else []
    return [Reading(**(entry | {"becomes": tuple(entry["becomes"])})) for entry in known]


class Count(NamedTuple):
    """A module's mutants, in numbers and by their readings."""

    n_mutants: int
    n_killed: int
    equivalent: list[tuple[Mutant, Reading]]
    survived: list[tuple[Mutant, Reading | None]]

    @property
    def score(self) -> float:
        """The share killed of those that are not equivalent."""
        return self.n_killed / (self.n_mutants - len(self.equivalent))


def count(module: str, session: Session, known: Iterable[Reading]) -> Count:
    """Count a module's mutants that were run."""
    survived = [(mutant, reading(module, mutant, known)) for mutant in session.those(SURVIVED)]
    equivalent = [(mutant, read) for mutant, read in survived if read and read.equivalent]
    n_killed = len(session.those(KILLED))
    left = [(mutant, read) for mutant, read in survived if not (read and read.equivalent)]
    return Count(n_killed + len(survived), n_killed, equivalent, left)


def reading(module: str, mutant: Mutant, known: Iterable[Reading]) -> Reading | None:
    """What was read of a mutant."""
    return next((read for read in known if read.is_of(module, mutant)), None)


def idle(counts: Mapping[str, Count], known: Iterable[Reading]) -> list[Reading]:
    """The lines that were read of modules that were run and that no living mutant has."""
    alive = {
        (module, mutant.function, mutant.becomes)
        for module, of in counts.items()
        for mutant, _ in [*of.equivalent, *of.survived]
    }
    left = [
        read._replace(becomes=tuple(line for line in read.becomes if (read.module, read.function, line) not in alive))
        for read in known
        if read.module in counts
    ]
    return [read for read in left if read.becomes]


def page(counts: Mapping[str, Count], about: str) -> str:
    """The whole page."""
    total = Count(
        sum(of.n_mutants for of in counts.values()),
        sum(of.n_killed for of in counts.values()),
        [pair for of in counts.values() for pair in of.equivalent],
        [pair for of in counts.values() for pair in of.survived],
    )
    lines = ["# Mutation testing", "", about.strip(), ""]
    lines += ["| module | mutants | killed | equivalent | survived | score |", "| --- | --- | --- | --- | --- | --- |"]
    for name, of in [*((f"`{module}`", of) for module, of in counts.items()), ("all", total)]:
        figures = of.n_mutants, of.n_killed, len(of.equivalent), len(of.survived), f"{of.score:.1%}"
        lines.append(f"| {name} | {' | '.join(map(str, figures))} |")
    for title, part in (("Survived", "survived"), ("Equivalent", "equivalent")):
        lines += ["", f"## {title}"]
        for module, of in counts.items():
            if getattr(of, part):
                lines += ["", f"`{module}`", "", *_items(getattr(of, part))]
    return "\n".join(lines) + "\n"


def _items(mutants: Iterable[tuple[Mutant, Reading | None]]) -> list[str]:
    """An item for each line of the source and reason."""
    grouped: dict[tuple[str, str, str], list[str]] = {}
    for mutant, read in mutants:
        why = read.why if read else "**not read**"
        grouped.setdefault((mutant.function, mutant.line, why), []).append(mutant.becomes)
    return [
        f"- {function}: `{line}` as {', '.join(f'`{become}`' for become in becomes)}: {why}"
        for (function, line, why), becomes in grouped.items()
    ]
