"""``sweep``: many runs in parallel."""

from __future__ import annotations

import argparse
from pathlib import Path

from esp_trainer.cli.options import ADDRESS, positive

SUMMARY = "run all combinations of presets, values of fields and seeds"
_FILE = """FILE declares the runs, for example

  preset = ["paper-3v2", "modern-3v2"]  # or one of them
  seeds = 10                            # 0 to 9; or a list

  [fields]                              # of every run's config; a list is tried value by value
  generations = 100
  esp.n_trials = [500, 1000]

Each run has a directory of its own in DIR, named after its preset, its values from lists and its seed. After Ctrl-C,
kill -9 or a power cut the same command resumes the sweep. It retries failed runs and starts newly added ones. On a
cluster of several machines DIR must be one that all of them share.
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``sweep``."""
    parser.epilog = _FILE
    parser.add_argument("file", type=Path, metavar="FILE", help="file that declares the runs; see below")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="directory of the runs; by default runs/ and the name of FILE"
    )
    where = parser.add_mutually_exclusive_group()
    where.add_argument(
        "--workers", type=positive, metavar="N", help="number of runs at a time; by default one for each core"
    )
    where.add_argument("--address", metavar="ADDRESS", help=f"run on a Ray cluster: {ADDRESS}")
    parser.add_argument("--quiet", action="store_true", help="print a line for each run instead of progress bars")


def run(options: argparse.Namespace) -> int:
    """Run ``sweep``, and return its exit status."""
    from esp_trainer.cli.sweep import sweep

    return sweep(options.file, options.out, options.workers, options.address, quiet=options.quiet)
