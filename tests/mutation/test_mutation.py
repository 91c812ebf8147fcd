"""Mutation testing itself: mutants are made, and the tests kill those that change something."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("cosmic_ray")


def mutation(*options: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(Path(__file__).with_name("mutation.py")), *options]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_mutants_are_made_and_killed() -> None:
    done = mutation("--quick")
    assert done.returncode == 0, done.stderr
    # Two of the ten compare with `<= 0` or `< 1` and make 0 a whole turn, which the next line takes back.
    assert re.fullmatch(r"predprey_env/rules/torus.py, plain: 10 of 10, 8 killed, \d+ s\n", done.stderr)


def test_a_module_that_it_does_not_know_is_refused() -> None:
    done = mutation("nothing")
    assert done.returncode == 2
    assert "modules must be among torus, dynamics," in done.stderr
    assert "got nothing" in done.stderr
