"""``resume``: a run that was stopped."""

from __future__ import annotations

import argparse
from pathlib import Path

from esp_trainer.cli.options import add_players, positive

SUMMARY = "continue a run that was stopped"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``resume``."""
    parser.add_argument("directory", type=Path, metavar="DIR", help="directory of the run")
    parser.add_argument(
        "--generations", type=positive, metavar="N", help="total number of generations, if the run is to be made longer"
    )
    add_players(parser)


def run(options: argparse.Namespace) -> int:
    """Run ``resume``, and return its exit status."""
    from esp_trainer.cli import training

    players = training.Players(options.threads, options.address)
    following = training.Following(options.quiet, options.tensorboard)
    return training.resume(options.directory, options.generations, players, following)
