"""``presets``: the experiments."""

from __future__ import annotations

import argparse

from esp_trainer.cli.overrides import describe_fields
from esp_trainer.presets import PRESETS, preset
from esp_trainer.tasks import WORLDS

SUMMARY = "list the experiments, or all fields of one"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``presets``."""
    parser.add_argument(
        "preset",
        nargs="?",
        metavar="PRESET",
        help="experiment to show, or a task for its recommended one; by default all are listed",
    )


def run(options: argparse.Namespace) -> int:
    """Run ``presets``, and return its exit status."""
    if options.preset:
        shown = preset(options.preset)
        print(f"{shown.preset}: {PRESETS[shown.preset][0]}\n{describe_fields(shown)}")
        return 0
    width = max(map(len, PRESETS))
    for known, (meaning, _) in PRESETS.items():
        print(f"{known:{width}}  {meaning}")
    print(f"\nA task stands for its recommended preset: {', '.join(f'{name} for race-{name}' for name in WORLDS)}.")
    return 0
