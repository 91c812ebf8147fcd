"""``train``: a run from its first generation."""

from __future__ import annotations

import argparse
from contextlib import suppress
from pathlib import Path

from esp_trainer.cli.options import add_players
from esp_trainer.cli.overrides import describe_fields, override
from esp_trainer.config import RunConfig
from esp_trainer.presets import preset

SUMMARY = "start a run"


class _Preset(argparse.Action):
    """The argument PRESET. A ``--help`` that follows it shows the values of this preset."""

    def __call__(
        self, parser: argparse.ArgumentParser, namespace: argparse.Namespace, values: object, _option: object = None
    ) -> None:
        setattr(namespace, self.dest, values)
        with suppress(ValueError):  # which `run` raises too
            parser.epilog = _every_field(preset(str(values)))


def _every_field(config: RunConfig) -> str:
    """Return the end of ``--help``: all fields, with their values in a preset."""
    fields = describe_fields(config).replace("%", "%%")
    return f"Any field of the config is an option too, here with its value in {config.preset}:\n\n{fields}"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``train``."""
    parser.epilog = _every_field(preset("paper-3v2"))
    named = "name of the experiment; `esp-trainer presets` lists them"
    parser.add_argument("preset", action=_Preset, metavar="PRESET", help=named)
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
