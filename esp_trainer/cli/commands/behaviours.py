"""``behaviours``: rates of behaviours."""

from __future__ import annotations

import argparse
from pathlib import Path

from esp_trainer.cli.options import add_runs

SUMMARY = "measure how often champions show each behaviour, by generation"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``behaviours``."""
    parser.add_argument("--csv", type=Path, metavar="FILE", help="file for the rates of every generation")
    add_runs(parser, generations=24, episodes=128, each="generation")


def run(options: argparse.Namespace) -> int:
    """Run ``behaviours``, and return its exit status."""
    from esp_trainer.cli.behaviours import behaviours

    return behaviours(options.runs, options.generations, options.episodes, options.csv)
