"""``train``: a run from its first generation."""

from __future__ import annotations

import argparse
from pathlib import Path

from esp_trainer.cli.options import add_players
from esp_trainer.cli.overrides import describe_fields, override
from esp_trainer.presets import PRESETS, preset

SUMMARY = "start a run"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``train``."""
    every_field = describe_fields(PRESETS["paper-3v2"][1]).replace("%", "%%")
    parser.epilog = f"Any field of the config is an option too, here with its value in paper-3v2:\n\n{every_field}"
    parser.add_argument("preset", metavar="PRESET", help="name of the experiment; `esp-trainer presets` lists them")
    parser.add_argument("--out", type=Path, metavar="DIR", help="directory of the run; by default runs/PRESET-seedSEED")
    parser.add_argument(
        "--league", nargs="+", type=Path, default=[], metavar="RUN", help="runs whose champions join the opponent pools"
    )
    add_players(parser)


def run(options: argparse.Namespace) -> int:
    """Run ``train``, and return its exit status."""
    from esp_trainer.cli import training

    config = override(preset(options.preset), options.fields)
    players = training.Players(options.threads, options.address)
    following = training.Following(options.quiet, options.tensorboard)
    return training.train(config, options.out, players, following, options.league)
