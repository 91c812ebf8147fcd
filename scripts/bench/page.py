"""The command line and the page that the benchmarks have in common."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping
from typing import NamedTuple, TypeVar

from bench.report import Row, machine, table

Scale = TypeVar("Scale")


class Page(NamedTuple):
    """What tells one benchmark's page from another's."""

    title: str
    script: str
    """Its file's name."""
    summary: str
    """What it does, for ``--help``."""
    about: str
    """What the table holds, in paragraphs."""
    packages: tuple[str, ...]
    """Whose versions count."""


def measure_and_print(
    page: Page, sections: Mapping[str, Callable[[Scale], list[Row]]], full: Scale, quick: Scale
) -> None:
    """Measure the sections that the command line asks for, and print the page."""
    parser = argparse.ArgumentParser(description=page.summary)
    parser.add_argument("--quick", action="store_true", help="only see that everything runs")
    parser.add_argument("--only", choices=sections, nargs="+", default=list(sections), help="parts of the table")
    options = parser.parse_args()

    rows: list[Row] = []
    for name in options.only:
        print(f"measuring {name} ...", file=sys.stderr, flush=True)
        rows += sections[name](quick if options.quick else full)
    print(f"# {page.title}\n\nWritten by `scripts/{page.script}`. {machine(page.packages)}.\n")
    if options.quick:
        print("A smoke run: the work is too small for its figures to mean anything, so nothing is judged.\n")
        rows = [row._replace(met=None) for row in rows]
    print(*(paragraph.replace("\n", " ").strip() + "\n" for paragraph in page.about.split("\n\n")), sep="\n")
    print(table(rows))
