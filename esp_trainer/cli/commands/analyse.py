"""``analyse``: measures of an arms race."""

from __future__ import annotations

import argparse
from pathlib import Path

from esp_trainer.cli.options import add_runs
from predprey_env.extras import extra

SUMMARY = "measure whether runs show an arms race"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``analyse``."""
    parser.add_argument("--figures", type=Path, metavar="DIR", help="directory for figures")
    add_runs(parser, generations=46, episodes=64)


def run(options: argparse.Namespace) -> int:
    """Run ``analyse``, and return its exit status."""
    with extra("analysis", "analyse"):
        from esp_trainer.cli.analysis import analyse

    return analyse(options.runs, options.generations, options.episodes, options.figures)
