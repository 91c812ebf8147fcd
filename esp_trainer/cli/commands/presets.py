"""``presets``: the experiments."""

from __future__ import annotations

import argparse

from esp_trainer.cli.overrides import describe_fields
from esp_trainer.presets import PRESETS, preset

SUMMARY = "list the experiments, or all fields of one"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``presets``."""
    parser.add_argument("preset", nargs="?", metavar="PRESET", help="experiment to show; by default all are listed")


def run(options: argparse.Namespace) -> int:
    """Run ``presets``, and return its exit status."""
    if name := options.preset:
        print(f"{name}: {PRESETS[name][0] if preset(name) else ''}\n{describe_fields(preset(name))}")
        return 0
    width = max(map(len, PRESETS))
    for known, (meaning, _) in PRESETS.items():
        print(f"{known:{width}}  {meaning}")
    return 0
