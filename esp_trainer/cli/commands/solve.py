"""``solve``: optimal play."""

from __future__ import annotations

import argparse
from pathlib import Path

from esp_trainer.cli.options import add_small_world, small_world

SUMMARY = "compute optimal play on a small torus"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``solve``."""
    parser.add_argument(
        "--out", type=Path, metavar="FILE", help="save the game, for replay optimal:FILE and Solution.load"
    )
    add_small_world(parser)


def run(options: argparse.Namespace) -> int:
    """Run ``solve``, and return its exit status."""
    from esp_trainer.cli.exact import solve

    return solve(small_world(options), options.out)
