"""``report``: a page about runs."""

from __future__ import annotations

import argparse
from pathlib import Path

from esp_trainer.cli.options import add_runs
from predprey_env.extras import extra

SUMMARY = "write an HTML page about runs: a summary, charts, and a player of any match"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``report``."""
    parser.add_argument(
        "--out", type=Path, metavar="FILE", help="page to write; by default report.html beside the runs"
    )
    add_runs(parser, generations=46, episodes=64)


def run(options: argparse.Namespace) -> int:
    """Run ``report``, and return its exit status."""
    with extra("analysis", "report"):
        from esp_trainer.cli.report import report
        from esp_trainer.report.measure import ReportOptions

    return report(options.runs, options.out, ReportOptions(options.generations, options.episodes))
