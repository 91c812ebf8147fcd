"""``esp-trainer``: the command line of the trainer."""

from __future__ import annotations

import sys

from gymnasium.error import DependencyNotInstalled

from esp_trainer.cli.commands import COMMANDS
from esp_trainer.cli.overrides import read_options, split
from esp_trainer.cli.parser import make_parser
from esp_trainer.cli.streams import let_go, standard_streams
from esp_trainer.files import error_in_words


def main(arguments: list[str] | None = None) -> int:
    """Run a command and return its exit status. A user's mistake gives one line on standard error and status 1."""
    with standard_streams():
        return _outcome(sys.argv[1:] if arguments is None else arguments)


def _outcome(arguments: list[str]) -> int:
    try:
        try:
            return _run(arguments)
        finally:
            sys.stdout.flush()
    except BrokenPipeError:
        let_go(sys.stdout)
        return 1
    except KeyboardInterrupt:
        print("esp-trainer: interrupted", file=sys.stderr)
        return 130
    except MemoryError as error:
        return _fail(f"not enough memory: {error}" if str(error) else "not enough memory")
    except OSError as error:
        let_go(sys.stdout)
        return _fail(error_in_words(error))
    # A Warning is raised only if PYTHONWARNINGS turns warnings into errors.
    except (ValueError, ArithmeticError, DependencyNotInstalled, Warning) as error:
        return _fail(str(error))


def _fail(line: str) -> int:
    print(f"esp-trainer: {line}", file=sys.stderr)
    return 1


def _run(arguments: list[str]) -> int:
    parser = make_parser()
    fields: list[str] = []
    if arguments[:1] == ["train"]:
        # First split off the options that set fields: argparse would take the 3 of "--seed 3 smoke" for the preset.
        fields, arguments = split(arguments)
    options, unknown = parser.parse_known_args(arguments)
    if unknown and options.command != "train":
        options.refuse_option(unknown[0])
    read_options(unknown)
    options.fields = [*fields, *unknown]
    return COMMANDS[options.command].run(options)
