"""``evaluate``: one team against another."""

from __future__ import annotations

import argparse

from esp_trainer.cli.options import add_pair, positive

SUMMARY = "play many episodes of one team against another, and count captures"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``evaluate``."""
    parser.add_argument(
        "--episodes", type=positive, default=1000, metavar="N", help="number of episodes; by default 1000"
    )
    add_pair(parser, "the starts and of all samples")


def run(options: argparse.Namespace) -> int:
    """Run ``evaluate``, and return its exit status."""
    from esp_trainer.cli import teams

    return teams.evaluate(options.team, options.against, options.episodes, options.seed)
