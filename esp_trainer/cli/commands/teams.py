"""``teams``: the zoo."""

from __future__ import annotations

import argparse

from esp_trainer.tasks import WORLDS

SUMMARY = "list the evolved teams that ship with the package, best first"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``teams``."""
    parser.add_argument("--task", choices=WORLDS, help="list only the teams of this task")


def run(options: argparse.Namespace) -> int:
    """Run ``teams``, and return its exit status."""
    from esp_trainer.cli import teams

    return teams.zoo(options.task)
