"""``show``: the description of a team."""

from __future__ import annotations

import argparse

from esp_trainer.cli.options import add_team

SUMMARY = "print what a team is and where it came from"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``show``."""
    add_team(parser)


def run(options: argparse.Namespace) -> int:
    """Run ``show``, and return its exit status."""
    from esp_trainer.cli import teams

    return teams.show(options.team)
