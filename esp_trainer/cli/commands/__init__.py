"""The commands of ``esp-trainer``. Each is a module with a summary, ``add_options(parser)`` and ``run(options)``.

``run`` imports the modules that the command needs, because those of the analysis take a second to import and need the
extra ``analysis``.
"""

from __future__ import annotations

import argparse
from typing import Protocol, cast

from esp_trainer.cli.commands import (
    analyse,
    behaviours,
    benchmark,
    compare,
    evaluate,
    exploitability,
    presets,
    replay,
    report,
    resume,
    show,
    solve,
    sweep,
    teams,
    train,
    watch,
)


class Command(Protocol):
    """A module of this package."""

    SUMMARY: str
    """Summary of the command, for ``--help``."""

    def add_options(self, parser: argparse.ArgumentParser) -> None:
        """Add the command's options, and a text for the end of its ``--help`` if it needs one."""
        ...

    def run(self, options: argparse.Namespace) -> int:
        """Run the command, and return its exit status."""
        ...


_IN_ORDER = (train, resume, watch, sweep, evaluate, replay, show, teams, analyse, behaviours, report, compare)
COMMANDS: dict[str, Command] = {
    module.__name__.rpartition(".")[2]: cast("Command", module)
    for module in (*_IN_ORDER, benchmark, exploitability, solve, presets)
}
"""Name -> command, in the order of ``--help``."""
