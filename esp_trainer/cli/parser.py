"""What one may type: the commands of ``esp-trainer`` and their options."""

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

Each run has a directory of its own in DIR, named by its preset, its values from lists and its seed. The same command
goes on after Ctrl-C, kill -9 or a power cut, does again what failed, and does what was added to FILE. On a cluster of
several machines DIR must be one that all of them share.
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
What it does must follow from the position: scripts that remember (intercept, run_straight) cannot be measured. A
policy that draws its actions says their chances by a method

  chances(observations) -> {agent: [chance of each action]}
"""
)
_COMPARE = """\
Runs that differ in nothing but their seeds are a condition. Its name is its preset or, if conditions share one, the
fields in which they differ. All runs must be of one world. Their champions meet the same opponents: the held-out teams
of the zoo, if it has that world, and champions of --panel, on which nobody trained; and all scripts.
"""
_DRAWN = "draw the actions of sb3: and torch: by their chances"


class _Parser(argparse.ArgumentParser):
    """Argument parser whose errors fit on one line and name what is nearest to a word that it does not know."""

    _given: Sequence[str] = ()

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        self._given = args or ()
        return super().parse_known_args(args, namespace)

    def error(self, message: str) -> NoReturn:
        if "are required: " in message and (unknown := self._unknown_option()):
            self.refuse_option(unknown)  # what is missing may be there, misspelt
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
    bare, names = word.lower().lstrip("-"), {name.lstrip("-"): name for name in known}  # dashes are alike in all
    near = difflib.get_close_matches(bare, names, n=1)
    return f"; did you mean {names[near[0]]}?" if near else ""


class _Command(Protocol):
    """Makes a command."""

    def __call__(self, name: str, summary: str, epilog: str | None = None) -> argparse.ArgumentParser: ...


def make_parser() -> argparse.ArgumentParser:
    """All commands, in the order of ``--help``."""
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
    presets = command("presets", "list the experiments, or every field of one")
    presets.add_argument("preset", nargs="?", metavar="PRESET")
    return parser


def _add_training(command: _Command) -> None:
    every_field = "Any field of the config is an option too, here with its value in paper-3v2:\n\n"
    every_field = (every_field + describe(PRESETS["paper-3v2"][1])).replace("%", "%%")
    train = command("train", "begin a run", every_field)
    train.add_argument("preset", metavar="PRESET", help="its experiment; `esp-trainer presets` lists them")
    train.add_argument("--out", type=Path, metavar="DIR", help="where to; by default runs/PRESET-seedSEED")
    train.add_argument(
        "--league", nargs="+", type=Path, default=[], metavar="RUN", help="runs whose champions are past opponents too"
    )
    resume = command("resume", "go on with a run that was stopped")
    resume.add_argument("directory", type=Path, metavar="DIR")
    resume.add_argument("--generations", type=_positive, metavar="N", help="go on to this many")
    for each in (train, resume):
        each.add_argument("--threads", type=_positive, metavar="N", help="by default one for each core")
        each.add_argument("--address", metavar="ADDRESS", help=f"play on a Ray cluster: {_ADDRESS}")
        each.add_argument("--quiet", action="store_true", help="a line for each checkpoint, and no progress bar")
        each.add_argument("--tensorboard", action="store_true", help="write event files for TensorBoard too")
    watch = command("watch", "follow a run live: its curves, and its newest champions at play")
    watch.add_argument("run", type=Path, metavar="RUN", help="a directory in which train or resume is at work")
    watch.add_argument("--fps", type=_positive, default=12, metavar="N", help="frames a second")


def _add_sweep(command: _Command) -> None:
    sweep = command("sweep", "do many runs: presets by values of fields by seeds", _SWEEP)
    sweep.add_argument("file", type=Path, metavar="FILE", help="which; see below")
    sweep.add_argument("--out", type=Path, metavar="DIR", help="where to; by default runs/ and the name of the file")
    where = sweep.add_mutually_exclusive_group()
    where.add_argument("--workers", type=_positive, metavar="N", help="runs at a time; by default one for each core")
    where.add_argument("--address", metavar="ADDRESS", help=f"do them on a Ray cluster: {_ADDRESS}")
    sweep.add_argument("--quiet", action="store_true", help="a line for each run, and no bars")


def _add_teams(command: _Command) -> None:
    evaluate = command("evaluate", "play a team against another, and count")
    evaluate.add_argument("--episodes", type=_positive, default=1000, metavar="N")
    replay = command("replay", "watch a team play another, as text or as a video")
    replay.add_argument("--fps", type=_positive, default=12, metavar="N", help="frames a second")
    replay.add_argument("--gif", type=_video(".gif"), metavar="FILE", help="write a GIF, with what is seen in it")
    replay.add_argument("--mp4", type=_video(".mp4"), metavar="FILE", help="write an MP4 likewise")
    replay.add_argument(
        "--follow", type=_whole(5), metavar="CELLS", help="let pictures be so many cells wide and follow the chase"
    )
    replay.add_argument("--from", dest="first", type=_natural, default=0, metavar="STEP", help="begin there")
    replay.add_argument("--until", dest="last", type=_natural, metavar="STEP", help="end there")
    for each in (evaluate, replay):
        each.add_argument(
            "team",
            metavar="TEAM",
            help="a file from a run's champions/, or a team of the zoo; to replay also optimal:FILE of solve",
        )
        each.add_argument("--against", required=True, metavar="TEAM", help="likewise, or a script such as flee_nearest")
        each.add_argument("--seed", type=_natural, default=0, metavar="N")
    show = command("show", "say what a team is and where it came from")
    show.add_argument("team", metavar="TEAM")
    listed = command("teams", "list the evolved teams that ship with the package, best first")
    listed.add_argument("--task", choices=TASKS, help="only of that task")


def _add_analysis(command: _Command) -> None:
    analyse = command("analyse", "say whether runs show an arms race")
    analyse.add_argument("--figures", type=Path, metavar="DIR", help="draw its figures there too")
    behaviours = command("behaviours", "count what champions do, by generation")
    behaviours.add_argument("--csv", type=Path, metavar="FILE", help="write the rates of every generation there")
    report = command("report", "make a page of runs that one can open in a browser: the story, charts, and any match")
    report.add_argument("--out", type=Path, metavar="FILE", help="by default report.html beside what it is about")
    compare = command("compare", "put conditions side by side, each of several seeds", _COMPARE)
    compare.add_argument("--out", type=Path, metavar="FILE", help="by default compare.html beside what it is about")
    compare.add_argument("--csv", type=Path, metavar="FILE", help="write every measure of each run there")
    compare.add_argument(
        "--panel", nargs="+", type=Path, default=[], metavar="RUN", help="runs whose champions are opponents of all"
    )
    compare.add_argument("--against", metavar="NAME", help="the condition to compare with; by default the first")
    for each, generations, episodes in (
        (analyse, 46, 64),
        (behaviours, 24, 128),
        (report, 46, 64),
        (compare, 24, 64),
    ):
        which = "a directory that train made" + (", or one of runs, a sweep's for example" if each is compare else "")
        each.add_argument("runs", nargs="+", type=Path, metavar="RUN", help=which)
        each.add_argument("--generations", type=_positive, default=generations, metavar="N", help="to sample")
        each.add_argument("--episodes", type=_positive, default=episodes, metavar="N", help="of each meeting")


def _add_benchmark(command: _Command) -> None:
    benchmark = command("benchmark", "play any policy against the zoo and all scripts, and say how good it is", _SPECS)
    benchmark.add_argument("--policy", required=True, metavar="SPEC", help="who is measured; see below")
    benchmark.add_argument("--role", required=True, choices=ROLES, help="which side it plays")
    benchmark.add_argument("--task", required=True, choices=TASKS, help="predators against prey")
    benchmark.add_argument("--episodes", type=_positive, default=512, metavar="N", help="of each meeting")
    benchmark.add_argument("--seed", type=_natural, default=0, metavar="N", help="which starts")
    benchmark.add_argument("--drawn", action="store_true", help=_DRAWN)
    benchmark.add_argument("--name", help="what to call it; by default its SPEC")
    benchmark.add_argument("--out", type=Path, metavar="DIR", help="where to; by default benchmarks/NAME-ROLE-TASK")
    benchmark.add_argument("--leaderboard", type=Path, metavar="FILE", help="put the result into that Markdown file")


def _add_exact(command: _Command) -> None:
    exploitability = command("exploitability", "say how far a policy is from optimal play, on a small torus", _MEASURED)
    exploitability.add_argument("policy", metavar="SPEC", help="who is measured; see below")
    exploitability.add_argument("--role", required=True, choices=ROLES, help="which side it plays")
    exploitability.add_argument("--drawn", action="store_true", help=_DRAWN)
    solve = command("solve", "solve the game on a small torus: what optimal play is worth")
    solve.add_argument(
        "--out", type=Path, metavar="FILE", help="save the game, for replay optimal:FILE and Solution.load"
    )
    for each in (exploitability, solve):
        each.add_argument("--size", type=_positive, default=8, metavar="N", help="of the torus, in cells; by default 8")
        each.add_argument("--steps", type=_positive, metavar="N", help="of an episode; by default 1.5 times the size")
        each.add_argument("--predators", type=_positive, default=3, metavar="N", help="by default 3")
        each.add_argument("--prey", type=_positive, default=1, metavar="N", help="by default 1")
        each.add_argument("--no-idle", action="store_true", help="predators may not stand still")
        each.add_argument("--in-turns", action="store_true", help="the prey move first, and predators see it")


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
