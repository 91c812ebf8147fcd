"""The parser of the command line."""

from __future__ import annotations

import argparse
import difflib
import re
from collections.abc import Iterable, Sequence
from importlib.metadata import version
from itertools import takewhile
from typing import Any, NoReturn

from esp_trainer.cli.commands import COMMANDS


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


def make_parser() -> argparse.ArgumentParser:
    """Return the parser of all commands, which are in the order of ``--help``."""
    parser = _Parser(prog="esp-trainer", description="Coevolve predators and prey by ESP.", allow_abbrev=False)
    parser.add_argument("--version", action="version", version=f"esp-trainer {version('predprey-esp')}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, command in COMMANDS.items():
        made = commands.add_parser(
            name,
            help=command.SUMMARY,
            description=command.SUMMARY,
            allow_abbrev=False,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        made.set_defaults(refuse_option=made.refuse_option)
        command.add_options(made)
    return parser
