"""``benchmark``: a policy against the zoo."""

from __future__ import annotations

import argparse
from pathlib import Path

from esp_trainer.cli.options import SPECS, add_policy, natural, positive
from esp_trainer.tasks import WORLDS
from predprey_env.extras import extra

SUMMARY = "play a policy against the zoo and all scripts, and rate it"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``benchmark``."""
    parser.epilog = SPECS
    parser.add_argument("--policy", required=True, metavar="SPEC", help="policy to measure; see below")
    add_policy(parser)
    parser.add_argument("--task", required=True, choices=WORLDS, help="world to play in")
    parser.add_argument(
        "--episodes", type=positive, default=512, metavar="N", help="episodes against each opponent; by default 512"
    )
    parser.add_argument(
        "--seed", type=natural, default=0, metavar="N", help="seed of the starts and of all samples; by default 0"
    )
    parser.add_argument("--name", help="name of the policy in the tables; by default its SPEC")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="directory for the results; by default benchmarks/NAME-ROLE-TASK"
    )
    parser.add_argument("--leaderboard", type=Path, metavar="FILE", help="Markdown file to add the result to")


def run(options: argparse.Namespace) -> int:
    """Run ``benchmark``, and return its exit status."""
    with extra("analysis", "benchmark"):
        from esp_trainer.cli.benchmark import BenchmarkOptions, benchmark

    settings = BenchmarkOptions(options.role, options.task, options.episodes, options.seed, options.drawn)
    return benchmark(options.policy, options.name, settings, options.out, options.leaderboard)
