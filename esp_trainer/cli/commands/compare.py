"""``compare``: conditions of several seeds each."""

from __future__ import annotations

import argparse
from pathlib import Path

from esp_trainer.cli.options import add_runs
from predprey_env.extras import extra

SUMMARY = "compare conditions of several seeds each"
_CONDITIONS = """\
Runs that differ only in their seeds are one condition. Its name is its preset or, if conditions share a preset, the
fields in which they differ. All runs must have the same world. Their champions play the same opponents: the zoo's
held-out teams, if it has that world, the champions of the runs of --panel, and all scripts.
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``compare``."""
    parser.epilog = _CONDITIONS
    parser.add_argument(
        "--out", type=Path, metavar="FILE", help="page to write; by default compare.html beside the runs"
    )
    parser.add_argument("--csv", type=Path, metavar="FILE", help="file for every measure of each run")
    parser.add_argument(
        "--panel", nargs="+", type=Path, default=[], metavar="RUN", help="runs whose champions all others play against"
    )
    parser.add_argument("--against", metavar="NAME", help="condition to compare the others with; by default the first")
    add_runs(parser, generations=24, episodes=64, more=", or of several runs, such as a sweep's")


def run(options: argparse.Namespace) -> int:
    """Run ``compare``, and return its exit status."""
    with extra("analysis", "compare"):
        from esp_trainer.cli.compare import CompareOptions, compare

    how = CompareOptions(options.generations, options.episodes, options.against)
    return compare(options.runs, options.panel, options.out, options.csv, how)
