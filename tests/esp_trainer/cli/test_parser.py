"""What ``--help`` says of every command."""

from __future__ import annotations

import argparse

import pytest

from esp_trainer.cli.commands import COMMANDS
from esp_trainer.cli.parser import make_parser


def arguments_of(command: str) -> list[argparse.Action]:
    (commands,) = [action for action in make_parser()._actions if isinstance(action, argparse._SubParsersAction)]
    return list(commands.choices[command]._actions)


@pytest.mark.parametrize("command", COMMANDS)
def test_each_argument_has_a_text_that_names_its_default(command: str) -> None:
    for action in arguments_of(command):
        name = action.option_strings or action.dest
        assert action.help, name
        if isinstance(action.default, int) and not isinstance(action.default, bool):
            assert action.help.endswith(f"by default {action.default}"), name
