"""``esp-trainer``: the trainer on the command line."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import NoReturn

from esp_trainer.cli import teams, training
from esp_trainer.cli.overrides import describe, override
from esp_trainer.presets import PRESETS, preset


class _Parser(argparse.ArgumentParser):
    """Argument parser whose errors fit on one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message}\n")


def main(arguments: list[str] | None = None) -> int:
    """Run a command; a user's mistake is one line on standard error and a non-zero exit."""
    parser = _parser()
    options, fields = parser.parse_known_args(arguments)
    if fields and options.command != "train":
        parser.error(f"unexpected {fields[0]!r}")
    try:
        return _dispatch(options, fields)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # or Python complains while it closes it
        return 1
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        return _fail(f"{where}{error.strerror}" if error.strerror else str(error))
    except ValueError as error:
        return _fail(str(error))


def _fail(line: str) -> int:
    print(f"esp-trainer: {line}", file=sys.stderr)
    return 1


def _dispatch(options: argparse.Namespace, fields: list[str]) -> int:
    if options.command == "train":
        config = override(preset(options.preset), fields)
        return training.train(config, options.out, options.threads, quiet=options.quiet)
    if options.command == "resume":
        return training.resume(options.directory, options.generations, options.threads, quiet=options.quiet)
    if options.command == "evaluate":
        return teams.evaluate(options.team, options.against, options.episodes, options.seed)
    if options.command == "show":
        return teams.show(options.team)
    if options.command == "replay":
        return teams.replay(options.team, options.against, options.seed, options.fps)
    return _presets(options.preset)


def _presets(name: str | None) -> int:
    if name:
        print(f"{name}: {PRESETS[name][0] if preset(name) else ''}\n{describe(preset(name))}")
        return 0
    width = max(map(len, PRESETS))
    for known, (meaning, _) in PRESETS.items():
        print(f"{known:{width}}  {meaning}")
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="esp-trainer", description="Coevolve predators and prey by ESP.", allow_abbrev=False)
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")

    def command(name: str, summary: str, epilog: str | None = None) -> argparse.ArgumentParser:
        return commands.add_parser(
            name,
            help=summary,
            description=summary,
            epilog=epilog,
            allow_abbrev=False,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )

    every_field = "Any field of the config is an option too:\n\n" + describe(PRESETS["paper-3v2"][1])
    train = command("train", "begin a run", every_field)
    train.add_argument("preset", metavar="PRESET", help="its experiment; `esp-trainer presets` lists them")
    train.add_argument("--out", type=Path, metavar="DIR", help="where to; by default runs/PRESET-seedSEED")
    resume = command("resume", "go on with a run that was stopped")
    resume.add_argument("directory", type=Path, metavar="DIR")
    resume.add_argument("--generations", type=_positive, metavar="N", help="go on to this many")
    for each in (train, resume):
        each.add_argument("--threads", type=_positive, metavar="N", help="by default one for each core")
        each.add_argument("--quiet", action="store_true", help="a line for each checkpoint, and no progress bar")

    evaluate = command("evaluate", "play a team against another, and count")
    evaluate.add_argument("--episodes", type=_positive, default=1000, metavar="N")
    replay = command("replay", "watch a team play another, as text")
    replay.add_argument("--fps", type=float, default=12.0, metavar="N", help="frames a second, on a terminal")
    for each in (evaluate, replay):
        each.add_argument("team", metavar="TEAM", help="a file from a run's champions/")
        each.add_argument("--against", required=True, metavar="TEAM", help="a file, greedy_chase or flee_nearest")
        each.add_argument("--seed", type=int, default=0, metavar="N")
    show = command("show", "say what a team is and where it came from")
    show.add_argument("team", metavar="TEAM")
    presets = command("presets", "list the experiments, or every field of one")
    presets.add_argument("preset", nargs="?", metavar="PRESET")
    return parser


def _positive(text: str) -> int:
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"must be at least 1, got {number}")
    return number
