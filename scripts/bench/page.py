"""The page of a benchmark: sections of rows as one Markdown table, with targets and the machine they hold for."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from typing import NamedTuple, TypeVar

from study import commit, machine, table

Scale = TypeVar("Scale")


class Row(NamedTuple):
    """A line of the table."""

    what: str
    figure: str
    ratio: str = ""
    target: str = ""
    met: bool | None = None
    """Whether the target is met; None where there is none."""


def at_least(value: float, target: float) -> bool:
    """Return whether a target from below is met, as the figure is printed."""
    return round(value, 2) >= target


UNITS = {
    r"/CPU-s\b": " a CPU-second",
    r" CPU-s\b": " CPU-seconds",
    r" CPU-ms\b": " CPU-milliseconds",
    r"(?<=\d) x\b": " times",
}
"""Unit in a cell of the table -> words of prose."""


def in_words(cell: str) -> str:
    """Return a cell as prose says it: ``7 steps/CPU-s`` is ``7 steps a CPU-second``, ``2 x`` is ``2 times``."""
    for unit, words in UNITS.items():
        cell = re.sub(unit, words, cell)
    return cell


def measure_and_print(
    title: str,
    about: str,
    packages: tuple[str, ...],
    sections: Mapping[str, Callable[[Scale], list[Row]]],
    full: Scale,
    quick: Scale,
    answer: str,
) -> None:
    """Measure the sections that the command line asks for, and print the page.

    The page begins with ``answer``, in which ``{figure of ROW}`` and ``{ratio of ROW}`` stand for a cell, up to its
    first comma, of the first row that begins with ROW. A page that lacks one of these cells has no answer.
    """
    parser = argparse.ArgumentParser(description=f"Measure and print {title!r}.")
    parser.add_argument("--quick", action="store_true", help="only see that everything runs")
    parser.add_argument("--only", choices=sections, nargs="+", default=list(sections), help="parts of the table")
    options = parser.parse_args()

    rows: list[Row] = []
    for name in options.only:
        print(f"measuring {name} ...", file=sys.stderr, flush=True)
        rows += sections[name](quick if options.quick else full)
    print(f"# {title}\n")
    with suppress(LookupError):
        print(re.sub(r"\{(figure|ratio) of (.*?)\}", partial(_cell, rows), answer), end="\n\n")
    print(f"Written by `scripts/{parser.prog}` at commit {commit()}. {machine(packages)}.\n")
    if options.quick:
        print("A smoke run: the work is too small for its figures to mean anything, so nothing is judged.\n")
        rows = [row._replace(met=None) for row in rows]
    verdict = {True: "met", False: "**missed**", None: ""}
    width = 5 if any(row.target for row in rows) else 3
    lines = [[*row[:-1], verdict[row.met]][:width] for row in rows]
    print(about, table(["what", "figure", "ratio", "target", ""][:width], lines, "---:"), sep="\n")


def _cell(rows: list[Row], named: re.Match[str]) -> str:
    said = next((str(getattr(row, named[1])) for row in rows if row.what.startswith(named[2])), "")
    if not said:
        raise LookupError
    return in_words(said.split(", ")[0])
