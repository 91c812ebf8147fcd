"""The commands of ``esp-trainer`` and their options, as ``argparse`` reads them."""

from __future__ import annotations

import argparse
import difflib
import re
from collections.abc import Callable, Iterable, Sequence
from importlib.metadata import version
from itertools import takewhile
from pathlib import Path
from typing import Any, NoReturn, Protocol

from esp_trainer.cli.overrides import describe
from esp_trainer.presets import PRESETS
from esp_trainer.tasks import TASKS
from esp_trainer.types import ROLES

_ADDRESS = "HOST:PORT of its head node, auto for the one that is running here, or local to start one"
_SWEEP = """FILE declares the runs, for example

  preset = ["paper-3v2", "modern-3v2"]  # or one of them
  seeds = 10                            # 0 to 9; or a list

  [fields]                              # of every run's config; a list is tried value by value
  generations = 100
  esp.n_trials = [500, 1000]

Each run has a directory of its own in DIR, named after its preset, its values from lists and its seed. After Ctrl-C,
kill -9 or a power cut the same command resumes the sweep. It retries failed runs and starts newly added ones. On a
cluster of several machines DIR must be one that all of them share.
"""
_SPECS = """SPEC is one of

  greedy_chase                              a script
  paper-3v2/predators/seed-500-late         a team of the zoo
  runs/x/champions/prey-00099.safetensors   an evolved team
  sb3:PPO:model.zip                         a model of Stable-Baselines3; loading it runs what is pickled in it
  torch:my_module:make_network:weights.pt   a PyTorch or TorchRL module, made by my_module.make_network()
  my_module:my_policy                       a policy object, a class or function that makes one, or a function of
                                            observations; my_module is imported
"""


_MEASURED = (
    _SPECS.replace("paper-3v2/predators", "paper-3v1/predators").replace("prey-00099", "predators-00099")
    + """
Its actions must follow from the position: scripts with memory (intercept, run_straight) cannot be measured. A policy
that samples its actions needs a method that gives their probabilities,

  chances(observations) -> {agent: [probability of each action]}
"""
)
_COMPARE = """\
Runs that differ only in their seeds are one condition. Its name is its preset or, if conditions share a preset, the
fields in which they differ. All runs must have the same world. Their champions play the same opponents: the zoo's
held-out teams, if it has that world, the champions of the runs of --panel, and all scripts.
"""
_DRAWN = "let sb3: and torch: policies sample their actions; by default they take the most likely ones"


class _Parser(argparse.ArgumentParser):
    """Argument parser whose errors fit on one line and suggest the nearest known word."""

    _given: Sequence[str] = ()

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        self._given = args or ()
        return super().parse_known_args(args, namespace)

    def error(self, message: str) -> NoReturn:
        if "are required: " in message and (unknown := self._unknown_option()):
            self.refuse_option(unknown)  # the required option may be there, misspelt
        self.exit(2, f"{self.prog}: {message}\n")

    def _unknown_option(self) -> str | None:
        options = takewhile(lambda word: word != "--", self._given)
        return next((word for word in options if re.match("-[^0-9. ]", word) and not self._knows(word)), None)

    def _knows(self, option: str) -> bool:
        return option.partition("=")[0] in self._option_string_actions

    def refuse_option(self, option: str) -> NoReturn:
        """End with the error for an option that this command does not have."""
        self.error(f"unexpected {option!r}{_nearest(option.partition('=')[0], self._option_string_actions)}")

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            choices = list(map(str, action.choices))
            hint = _nearest(str(value), choices) or f" (choose from {', '.join(choices)})"
            raise argparse.ArgumentError(action, f"invalid choice: {value!r}{hint}")


def _nearest(word: str, known: Iterable[str]) -> str:
    bare, names = (
        word.lower().lstrip("-"),
        {name.lstrip("-"): name for name in known},
    )  # leading dashes would make all options alike
    near = difflib.get_close_matches(bare, names, n=1)
    return f"; did you mean {names[near[0]]}?" if near else ""


class _Command(Protocol):
    """Function that adds a command to the parser."""

    def __call__(self, name: str, summary: str, epilog: str | None = None) -> argparse.ArgumentParser: ...


def make_parser() -> argparse.ArgumentParser:
    """Return the parser of all commands, which are in the order of ``--help``."""
    parser = _Parser(prog="esp-trainer", description="Coevolve predators and prey by ESP.", allow_abbrev=False)
    parser.add_argument("--version", action="version", version=f"esp-trainer {version('predprey-esp')}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")

    def command(name: str, summary: str, epilog: str | None = None) -> argparse.ArgumentParser:
        made = commands.add_parser(
            name,
            help=summary,
            description=summary,
            epilog=epilog,
            allow_abbrev=False,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        made.set_defaults(refuse_option=made.refuse_option)
        return made

    for add in (_add_training, _add_sweep, _add_teams, _add_analysis, _add_benchmark, _add_exact):
        add(command)
    presets = command("presets", "list the experiments, or all fields of one")
    presets.add_argument("preset", nargs="?", metavar="PRESET")
    return parser


def _add_training(command: _Command) -> None:
    every_field = "Any field of the config is an option too, here with its value in paper-3v2:\n\n"
    every_field = (every_field + describe(PRESETS["paper-3v2"][1])).replace("%", "%%")
    train = command("train", "start a run", every_field)
    train.add_argument("preset", metavar="PRESET", help="name of the experiment; `esp-trainer presets` lists them")
    train.add_argument("--out", type=Path, metavar="DIR", help="directory of the run; by default runs/PRESET-seedSEED")
    train.add_argument(
        "--league", nargs="+", type=Path, default=[], metavar="RUN", help="runs whose champions join the opponent pools"
    )
    resume = command("resume", "continue a run that was stopped")
    resume.add_argument("directory", type=Path, metavar="DIR")
    resume.add_argument("--generations", type=_positive, metavar="N", help="total number of generations")
    for each in (train, resume):
        each.add_argument(
            "--threads", type=_positive, metavar="N", help="number of threads; by default one for each core"
        )
        each.add_argument("--address", metavar="ADDRESS", help=f"play on a Ray cluster: {_ADDRESS}")
        each.add_argument(
            "--quiet", action="store_true", help="print a line for each checkpoint instead of a progress bar"
        )
        each.add_argument("--tensorboard", action="store_true", help="write event files for TensorBoard too")
    watch = command("watch", "follow a run live: its curves, and its newest champions playing")
    watch.add_argument("run", type=Path, metavar="RUN", help="directory of a run")
    watch.add_argument("--fps", type=_positive, default=12, metavar="N", help="frames a second")


def _add_sweep(command: _Command) -> None:
    sweep = command("sweep", "run all combinations of presets, values of fields and seeds", _SWEEP)
    sweep.add_argument("file", type=Path, metavar="FILE", help="file that declares the runs; see below")
    sweep.add_argument(
        "--out", type=Path, metavar="DIR", help="directory of the runs; by default runs/ and the name of FILE"
    )
    where = sweep.add_mutually_exclusive_group()
    where.add_argument(
        "--workers", type=_positive, metavar="N", help="number of runs at a time; by default one for each core"
    )
    where.add_argument("--address", metavar="ADDRESS", help=f"run on a Ray cluster: {_ADDRESS}")
    sweep.add_argument("--quiet", action="store_true", help="print a line for each run instead of progress bars")


def _add_teams(command: _Command) -> None:
    evaluate = command("evaluate", "play many episodes of one team against another, and count captures")
    evaluate.add_argument("--episodes", type=_positive, default=1000, metavar="N")
    replay = command("replay", "show an episode of two teams, as text or as a video")
    replay.add_argument("--fps", type=_positive, default=12, metavar="N", help="frames a second")
    replay.add_argument(
        "--gif", type=_video(".gif"), metavar="FILE", help="write a GIF, with the names of detected behaviours"
    )
    replay.add_argument("--mp4", type=_video(".mp4"), metavar="FILE", help="write an MP4, likewise")
    replay.add_argument(
        "--follow",
        type=_whole(5),
        metavar="CELLS",
        help="width of the pictures, which follow the chase; by default they show the whole world",
    )
    replay.add_argument("--from", dest="first", type=_natural, default=0, metavar="STEP", help="first step to show")
    replay.add_argument("--until", dest="last", type=_natural, metavar="STEP", help="last step to show")
    for each in (evaluate, replay):
        each.add_argument(
            "team",
            metavar="TEAM",
            help="file from a run's champions/, or team of the zoo; for replay also optimal:FILE, a file of solve",
        )
        each.add_argument("--against", required=True, metavar="TEAM", help="likewise, or a script such as flee_nearest")
        each.add_argument("--seed", type=_natural, default=0, metavar="N")
    show = command("show", "print what a team is and where it came from")
    show.add_argument("team", metavar="TEAM")
    listed = command("teams", "list the evolved teams that ship with the package, best first")
    listed.add_argument("--task", choices=TASKS, help="list only the teams of this task")


def _add_analysis(command: _Command) -> None:
    analyse = command("analyse", "measure whether runs show an arms race")
    analyse.add_argument("--figures", type=Path, metavar="DIR", help="directory for figures")
    behaviours = command("behaviours", "measure how often champions show each behaviour, by generation")
    behaviours.add_argument("--csv", type=Path, metavar="FILE", help="file for the rates of every generation")
    report = command("report", "write an HTML page about runs: a summary, charts, and a player of any match")
    report.add_argument(
        "--out", type=Path, metavar="FILE", help="page to write; by default report.html beside the runs"
    )
    compare = command("compare", "compare conditions of several seeds each", _COMPARE)
    compare.add_argument(
        "--out", type=Path, metavar="FILE", help="page to write; by default compare.html beside the runs"
    )
    compare.add_argument("--csv", type=Path, metavar="FILE", help="file for every measure of each run")
    compare.add_argument(
        "--panel", nargs="+", type=Path, default=[], metavar="RUN", help="runs whose champions all others play against"
    )
    compare.add_argument("--against", metavar="NAME", help="condition to compare the others with; by default the first")
    for each, generations, episodes in (
        (analyse, 46, 64),
        (behaviours, 24, 128),
        (report, 46, 64),
        (compare, 24, 64),
    ):
        which = "directory of a run" + (", or of several runs, such as a sweep's" if each is compare else "")
        each.add_argument("runs", nargs="+", type=Path, metavar="RUN", help=which)
        each.add_argument(
            "--generations", type=_positive, default=generations, metavar="N", help="number of generations to sample"
        )
        each.add_argument(
            "--episodes", type=_positive, default=episodes, metavar="N", help="episodes per pair of teams"
        )


def _add_benchmark(command: _Command) -> None:
    benchmark = command("benchmark", "play a policy against the zoo and all scripts, and rate it", _SPECS)
    benchmark.add_argument("--policy", required=True, metavar="SPEC", help="policy to measure; see below")
    benchmark.add_argument("--role", required=True, choices=ROLES, help="side that it plays")
    benchmark.add_argument("--task", required=True, choices=TASKS, help="world, by the numbers of predators and prey")
    benchmark.add_argument(
        "--episodes", type=_positive, default=512, metavar="N", help="episodes against each opponent"
    )
    benchmark.add_argument(
        "--seed", type=_natural, default=0, metavar="N", help="seed of the starts and of all samples"
    )
    benchmark.add_argument("--drawn", action="store_true", help=_DRAWN)
    benchmark.add_argument("--name", help="name in the tables; by default its SPEC")
    benchmark.add_argument(
        "--out", type=Path, metavar="DIR", help="directory for the results; by default benchmarks/NAME-ROLE-TASK"
    )
    benchmark.add_argument("--leaderboard", type=Path, metavar="FILE", help="Markdown file to add the result to")


def _add_exact(command: _Command) -> None:
    exploitability = command(
        "exploitability", "measure how far a policy is from optimal play on a small torus", _MEASURED
    )
    exploitability.add_argument("policy", metavar="SPEC", help="policy to measure; see below")
    exploitability.add_argument("--role", required=True, choices=ROLES, help="side that it plays")
    exploitability.add_argument("--drawn", action="store_true", help=_DRAWN)
    solve = command("solve", "compute optimal play on a small torus")
    solve.add_argument(
        "--out", type=Path, metavar="FILE", help="save the game, for replay optimal:FILE and Solution.load"
    )
    for each in (exploitability, solve):
        each.add_argument(
            "--size", type=_positive, default=8, metavar="N", help="side of the torus, in cells; by default 8"
        )
        each.add_argument(
            "--steps", type=_positive, metavar="N", help="steps of an episode; by default 1.5 times the size"
        )
        each.add_argument(
            "--predators", type=_positive, default=3, metavar="N", help="number of predators; by default 3"
        )
        each.add_argument("--prey", type=_positive, default=1, metavar="N", help="number of prey; by default 1")
        each.add_argument("--no-idle", action="store_true", help="take the idle action from the predators")
        each.add_argument(
            "--in-turns", action="store_true", help="let the prey move first, and the predators see their move"
        )


def _video(suffix: str) -> Callable[[str], Path]:
    def path(text: str) -> Path:
        if Path(text).suffix.lower() != suffix:
            raise argparse.ArgumentTypeError(f"must end in {suffix}, got {text!r}")
        return Path(text)

    return path


def _whole(least: int, most: int | None = None) -> Callable[[str], int]:
    def number(text: str) -> int:
        try:
            value = int(text)
        except ValueError:  # more digits than Python will read, too
            value = least - 1
        if value < least:
            raise argparse.ArgumentTypeError(f"must be a whole number of at least {least}, got {text!r}")
        if most is not None and value > most:
            raise argparse.ArgumentTypeError(f"must be a whole number of at most {most}, got {text!r}")
        return value

    return number


_natural, _positive = _whole(0), _whole(1, 2**31 - 1)  # a seed or a step may be any; an array is not that long
