"""Options that several commands share, and the types of their values."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

from esp_trainer.types import ROLES
from predprey_env.config import EnvConfig

ADDRESS = "HOST:PORT of its head node, auto for the one that is running here, or local to start one"
SPECS = """SPEC is one of

  greedy_chase                              a script
  paper-3v2/predators/seed-500-late         a team of the zoo
  runs/x/champions/prey-00099.safetensors   an evolved team
  sb3:PPO:model.zip                         a model of Stable-Baselines3; loading it runs what is pickled in it
  torch:my_module:make_network:weights.pt   a PyTorch or TorchRL module, made by my_module.make_network()
  my_module:my_policy                       a policy object, a class or function that makes one, or a function of
                                            observations; my_module is imported
"""


def whole(least: int, most: int | None = None) -> Callable[[str], int]:
    """Return the type of a whole number from ``least`` to ``most``."""

    def number(text: str) -> int:
        try:
            value = int(text)
        except ValueError:  # also for more digits than Python reads
            value = least - 1
        if value < least:
            raise argparse.ArgumentTypeError(f"must be a whole number of at least {least}, got {text!r}")
        if most is not None and value > most:
            raise argparse.ArgumentTypeError(f"must be a whole number of at most {most}, got {text!r}")
        return value

    return number


natural = whole(0)  # a seed or a step may be any number
positive = whole(1, 2**31 - 1)  # the length of an array


def add_players(parser: argparse.ArgumentParser) -> None:
    """Add the options of commands that play the trials of a run."""
    parser.add_argument(
        "--threads",
        type=positive,
        metavar="N",
        help="number of threads (in another game, processes); by default one for each core",
    )
    parser.add_argument("--address", metavar="ADDRESS", help=f"play on a Ray cluster: {ADDRESS}")
    parser.add_argument(
        "--quiet", action="store_true", help="print a line for each checkpoint instead of a progress bar"
    )
    parser.add_argument("--tensorboard", action="store_true", help="write event files for TensorBoard too")


def add_team(parser: argparse.ArgumentParser, more: str = "") -> None:
    """Add the argument of commands that are about a team."""
    parser.add_argument(
        "team",
        metavar="TEAM",
        help=f"file from a run's champions/, or team of the zoo (`esp-trainer teams` lists them){more}",
    )


def add_pair(parser: argparse.ArgumentParser, seed_of: str, more: str = "") -> None:
    """Add the options of commands in which two teams play."""
    add_team(parser, more)
    parser.add_argument(
        "--against", required=True, metavar="TEAM", help="opponent: likewise, or a script such as flee_nearest"
    )
    parser.add_argument("--seed", type=natural, default=0, metavar="N", help=f"seed of {seed_of}; by default 0")


def add_runs(
    parser: argparse.ArgumentParser,
    generations: int,
    episodes: int,
    more: str = "",
    each: str = "pair of teams",
) -> None:
    """Add the options of commands that measure runs."""
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN", help=f"directory of a run{more}")
    parser.add_argument(
        "--generations",
        type=positive,
        default=generations,
        metavar="N",
        help=f"number of generations to sample; by default {generations}",
    )
    parser.add_argument(
        "--episodes",
        type=positive,
        default=episodes,
        metavar="N",
        help=f"episodes of each {each}; by default {episodes}",
    )


def add_policy(parser: argparse.ArgumentParser) -> None:
    """Add the options of commands that measure a policy, apart from the policy itself."""
    parser.add_argument("--role", required=True, choices=ROLES, help="side that the policy plays")
    parser.add_argument(
        "--drawn",
        action="store_true",
        help="let sb3: and torch: policies sample their actions; by default they take the most likely ones",
    )


def add_small_world(parser: argparse.ArgumentParser) -> None:
    """Add the options of commands that solve a game; :func:`small_world` reads them."""
    parser.add_argument(
        "--size", type=positive, default=8, metavar="N", help="side of the torus, in cells; by default 8"
    )
    parser.add_argument(
        "--steps", type=positive, metavar="N", help="steps of an episode; by default 1.5 times the size"
    )
    parser.add_argument("--predators", type=positive, default=3, metavar="N", help="number of predators; by default 3")
    parser.add_argument("--prey", type=positive, default=1, metavar="N", help="number of prey; by default 1")
    parser.add_argument("--no-idle", action="store_true", help="take the idle action from the predators")
    parser.add_argument(
        "--in-turns", action="store_true", help="let the prey move first, and the predators see their move"
    )


def small_world(options: argparse.Namespace) -> EnvConfig:
    """Return the world that the options of :func:`add_small_world` define."""
    return EnvConfig(
        size=options.size,
        n_predators=options.predators,
        n_prey=options.prey,
        max_cycles=options.steps or options.size * 3 // 2,
        predator_idle=not options.no_idle,
        move_order="prey_first" if options.in_turns else "simultaneous",
    )
