"""A policy of one's own that fails is told in one line, by both commands that measure it."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

MODULE = """
import numpy as np


class Good:
    def reset(self, seed=None):
        pass

    def act(self, observations):
        return dict.fromkeys(observations, 0)


def made(**methods):
    return type("Made", (Good,), methods)()


def fails(error):
    def method(self, *arguments):
        raise error

    return method


many = ValueError("\\n".join(map(str, range(100))))
act_raises = made(act=fails(many))
act_leaves = made(act=fails(SystemExit("bye")))
act_array = made(act=lambda self, seen: np.zeros((len(seen), 50, 50)))
act_floats = made(act=lambda self, seen: dict.fromkeys(seen, 0.0))
act_far = made(act=lambda self, seen: dict.fromkeys(seen, 4))
act_partly = made(act=lambda self, seen: {})
reset_raises = made(reset=fails(KeyError("seed")))
batch_raises = made(act_batch=fails(TypeError("no")))
batch_flat = made(act_batch=lambda self, seen: np.zeros(len(seen), int))
batch_floats = made(act_batch=lambda self, seen: np.zeros(seen.shape[:2]))
batch_ragged = made(act_batch=lambda self, seen: [[0], [0, 1]])
compiles_not = made(compiled=fails(RuntimeError("no")))
interrupted = made(act=fails(KeyboardInterrupt()))
chances_raise = made(chances=fails(ZeroDivisionError("by zero")))
chances_words = made(chances=lambda self, seen: dict.fromkeys(seen, ["a"] * 4))
chances_short = made(chances=lambda self, seen: dict.fromkeys(seen, [0.5, 0.5]))
chances_array = made(chances=lambda self, seen: np.zeros((50, 50)))
chances_batch_none = made(chances_batch=lambda self, seen: None)
chances_batch_ragged = made(chances_batch=lambda self, seen: [[0], [0, 1]])


class Tensor:
    # Refuses NumPy, as tensors do that require a gradient or are on a GPU.

    def __init__(self, error):
        self.error = error

    def __array__(self, *arguments, **named):
        raise self.error

    def __len__(self):
        raise self.error

    def __repr__(self):
        return "tensor"


class Answers(dict):
    def __getitem__(self, name):
        raise ZeroDivisionError("by zero")

    def __repr__(self):
        return "answers"


grad = Tensor(RuntimeError("it requires grad"))
chances_grad = made(chances=lambda self, seen: dict.fromkeys(seen, grad))
chances_batch_grad = made(chances_batch=lambda self, seen: grad)
chances_batch_cuda = made(chances_batch=lambda self, seen: Tensor(TypeError("it is on a GPU")))
chances_ragged = made(chances=lambda self, seen: dict.fromkeys(seen, [[1], [0, 0], 0, 0]))
chances_mapping = made(chances=lambda self, seen: Answers(seen))
act_mapping = made(act=lambda self, seen: Answers(seen))
chances_sum = made(chances=lambda self, seen: dict.fromkeys(seen, [0.25, 0.25, 0.25, 0.2498]))
chances_property = made(chances=property(fails(RuntimeError("no weights"))))
chances_batch_property = made(chances_batch=property(fails(RuntimeError("no weights"))))
drawn_property = made(chances_batch=lambda self, seen: None, drawn=property(fails(RuntimeError("no weights"))))
absent = made(chances=None, chances_batch=None, act_batch=None)


class Unmade:
    def __init__(self):
        raise OSError(2, "No such file", "weights.pt")


def __getattr__(name):
    if name == "trap":
        raise RuntimeError("a trap")
    raise AttributeError(name)
"""

BOTH = {
    "act_raises": "the policy's act() raised ValueError: 0 1 2 3 ",
    "act_leaves": "the policy's act() raised SystemExit: bye",
    "act_array": "the policy's act() must return a mapping from agents to actions, got array(",
    "act_floats": "the policy's act() must return an action for each agent: the action of prey_0 must be an integer",
    "act_far": "the policy's act() must return an action for each agent: the action of prey_0 must be in 0..3, got 4",
    "act_partly": "the policy's act() must return an action for each agent: an action for prey_0 is missing",
    "reset_raises": "the policy's reset() raised KeyError: 'seed'",
    "batch_raises": "the policy's act_batch() raised TypeError: no",
    "batch_flat": "the policy's act_batch() must return integers of shape (",
    "batch_floats": "the policy's act_batch() must return integers of shape (",
    "batch_ragged": "the policy's act_batch() raised ValueError: ",
    "compiles_not": "mine:compiles_not's compiled() raised RuntimeError: no",
    "Unmade": "mine:Unmade() raised FileNotFoundError: [Errno 2] No such file",
    "trap": "mine:trap cannot be read: RuntimeError: a trap",
    "nothing": "mine has no nothing",
}
EXACT = {
    "chances_raise": "the policy's chances() raised ZeroDivisionError: by zero",
    "chances_words": "chances must be 4 numbers for each agent, got [['a', 'a', 'a', 'a']]",
    "chances_short": "chances must be 4 numbers for each agent, got [[0.5, 0.5]]",
    "chances_array": "the policy must answer for prey_0, got array(",
    "chances_batch_none": "the policy must answer with an array of shape (1, 1, 4), got None",
    "chances_batch_ragged": "the policy must answer with an array of shape (1, 1, 4), got [[0], [0, 1]]: Value",
    "chances_grad": "chances must be 4 numbers for each agent, got [tensor]: RuntimeError: it requires grad",
    "chances_batch_grad": "the policy must answer with an array of shape (1, 1, 4), got tensor: RuntimeError: it req",
    "chances_batch_cuda": "the policy must answer with an array of shape (1, 1, 4), got tensor: TypeError: it is on",
    "chances_ragged": "chances must be 4 numbers for each agent, got [[[1], [0, 0], 0, 0]]: ",
    "chances_mapping": "the policy must answer for prey_0, got answers: ZeroDivisionError: by zero",
    "act_mapping": "the policy's actions cannot be read: ZeroDivisionError: by zero",
    "chances_sum": "chances must be at least 0 and add up to 1, "
    "got [0.25, 0.25, 0.25, 0.2498], which add up to 0.9998, "
    "for prey_0 where it sees [",
    "chances_property": "the policy's chances cannot be read: RuntimeError: no weights",
    "chances_batch_property": "the policy's chances_batch cannot be read: RuntimeError: no weights",
    "drawn_property": "the policy's drawn cannot be read: RuntimeError: no weights",
}


@pytest.fixture
def asked(
    esp_trainer: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[[str, str], Any]:
    """``asked(command, name)``: what a command says of a prey in the module."""
    (tmp_path / "mine.py").write_text(MODULE)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "mine", raising=False)
    prey = ["--role", "prey"]

    def ask(command: str, name: str) -> Any:
        if command == "benchmark":
            return esp_trainer(command, "--policy", f"mine:{name}", *prey, "--task", "3v1", "--episodes", "2")
        return esp_trainer(command, f"mine:{name}", *prey, "--size", "3", "--steps", "2")

    return ask


@pytest.mark.parametrize(
    ("command", "name", "says"),
    [("benchmark", *each) for each in BOTH.items()] + [("exploitability", *each) for each in (BOTH | EXACT).items()],
)
def test_what_is_wrong_with_a_policy_is_told_in_one_line(
    command: str, name: str, says: str, asked: Callable[[str, str], Any]
) -> None:
    outcome = asked(command, name)
    assert (outcome.code, outcome.out) == (1, "")
    (line,) = [line for line in outcome.err.splitlines() if line.startswith("esp-trainer: ")]
    assert line.startswith(f"esp-trainer: {says}")
    assert len(outcome.err.splitlines()) <= 4, "what it does and needs"


def test_methods_that_are_none_count_as_absent(asked: Callable[[str, str], Any]) -> None:
    outcome = asked("exploitability", "absent")
    assert outcome.code == 0
    assert outcome.out.splitlines()[0].startswith("mine:absent, prey on a torus of 3 x 3")


@pytest.mark.parametrize("command", ["benchmark", "exploitability"])
def test_an_interrupt_in_a_policy_interrupts(command: str, asked: Callable[[str, str], Any]) -> None:
    outcome = asked(command, "interrupted")
    assert outcome.code == 130
    assert outcome.err.splitlines()[-1] == "esp-trainer: interrupted"
