"""From figures to one Markdown table, and the facts of the machine that they hold for."""

from __future__ import annotations

import os
import platform
from collections.abc import Iterable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import NamedTuple


class Row(NamedTuple):
    """A line of the table."""

    what: str
    figure: str
    ratio: str = ""
    target: str = ""
    met: bool | None = None
    """Whether the target is met; None where there is none."""


def at_least(value: float, target: float) -> bool:
    """Whether a target from below is met, as the figure is printed."""
    return round(value, 2) >= target


def table(rows: Iterable[Row]) -> str:
    """The rows as a Markdown table."""
    verdict = {True: "met", False: "**missed**", None: ""}
    lines = ["| what | figure | ratio | target | |", "| --- | ---: | ---: | ---: | --- |"]
    lines += [f"| {r.what} | {r.figure} | {r.ratio} | {r.target} | {verdict[r.met]} |" for r in rows]
    return "\n".join(lines)


def machine(packages: Iterable[str]) -> str:
    """Processor and versions, without anything that names this machine."""
    versions = ", ".join(f"{package} {_version(package)}" for package in packages)
    return (
        f"{_processor()}, {os.cpu_count()} cores, {platform.system()}; Python {platform.python_version()}, {versions}"
    )


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def _processor() -> str:
    """The model that Linux names, or at least the architecture."""
    facts = Path("/proc/cpuinfo")
    if facts.is_file():
        for line in facts.read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
