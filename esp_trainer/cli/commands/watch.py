"""``watch``: a live view of a run."""

from __future__ import annotations

import argparse
from pathlib import Path

from esp_trainer.cli.options import positive

SUMMARY = "follow a run live: its curves, and its newest champions playing"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``watch``."""
    parser.add_argument("run", type=Path, metavar="RUN", help="directory of a run")
    parser.add_argument("--fps", type=positive, default=12, metavar="N", help="frames a second; by default 12")


def run(options: argparse.Namespace) -> int:
    """Run ``watch``, and return its exit status."""
    from esp_trainer.cli.watch import watch

    return watch(options.run, options.fps)
