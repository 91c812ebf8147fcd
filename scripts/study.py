"""Parts that studies share: their options, and filling a page with numbers."""

from __future__ import annotations

import argparse
import os
import platform
import re
import string
import subprocess
from collections.abc import Iterable, Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from esp_trainer.cores import cores

SMALL: dict[str, Any] = {
    "generations": 9,
    "checkpoint_every": 6,
    "esp.subpopulation_size": 20,
    "esp.n_trials": 60,
    "esp.n_episodes": 2,
    "esp.hof_mates": 0,
    "champion.n_candidates": 4,
    "champion.n_past": 0,
    "esp.exploiter_generations": 2,
    "champion.n_held_out": 32,
}
"""Fields of a run that takes seconds and means nothing."""
SMALL_WORLD = {"env.size": 16, "env.max_cycles": 30}
"""Fields of a small world, for runs that meet no teams of the zoo: those play in the worlds of their tasks."""


class StudyParser(argparse.ArgumentParser):
    """The options of a study.

    Args:
        about: Description of the study.
        runs: Where its runs are kept.
        quick: Where the runs and the page of its quick form go.
    """

    def __init__(self, about: str | None, runs: str, quick: str) -> None:
        super().__init__(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
        self.add_argument("--quick", action="store_true", help="small and meaningless, to see that it works")
        self.add_argument("--report", action="store_true", help="run nothing, only write the page again")
        self.add_argument("--runs", type=Path, help=f"where runs are kept; by default {runs}, or {quick}")
        self.add_argument("--out", type=Path, help=f"where the page goes; by default docs, or {quick}")
        self.add_argument("--workers", type=int, default=cores(), help="processes; by default one a core")
        self._places = {False: (runs, "docs"), True: (quick, quick)}

    def read(self) -> argparse.Namespace:
        """Return what was given, and where runs and page go if that was not."""
        options = self.parse_args()
        runs, out = map(Path, self._places[options.quick])
        options.runs, options.out = options.runs or runs, options.out or out
        return options


def table(heads: Iterable[str], rows: Iterable[Iterable[object]], align: str = "---") -> str:
    """Return a Markdown table; ``align`` is the alignment of all columns but the first, as Markdown writes it."""
    heads = list(heads)
    lines = [heads, ["---", *[align] * (len(heads) - 1)], *rows]
    return "\n".join(f"| {' | '.join(map(str, line))} |" for line in lines)


def fill(template: Path, values: Mapping[str, object]) -> str:
    """Return a page: a Markdown file with its ``{fields}`` filled in, without the sections that lack a value (None)."""
    sections = re.split(r"^(?=## )", template.read_text(), flags=re.MULTILINE)
    fields = [[name for _, name, _, _ in string.Formatter().parse(section) if name] for section in sections]
    there = (s for s, names in zip(sections, fields, strict=True) if all(values[name] is not None for name in names))
    return "".join(there).format_map(values)


def commit() -> str:
    """Return the commit of this repository, or ``unknown``."""
    try:
        return subprocess.check_output(["git", "rev-parse", "--short", "HEAD"], text=True).strip()
    except (OSError, subprocess.CalledProcessError):  # no git, or no repository
        return "unknown"


def machine(packages: Iterable[str]) -> str:
    """Return the processor and the versions, without anything that names this machine."""
    facts = Path("/proc/cpuinfo").read_text() if Path("/proc/cpuinfo").is_file() else ""
    model = re.search(r"^model name\s*: (.*)$", facts, re.MULTILINE)
    processor = model[1].strip() if model else platform.processor() or platform.machine()
    versions = ", ".join(f"{package} {_version(package)}" for package in packages)
    return f"{processor}, {os.cpu_count()} cores, {platform.system()}; Python {platform.python_version()}, {versions}"


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
