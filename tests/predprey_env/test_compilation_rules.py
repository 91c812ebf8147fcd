"""Rules are compiled once for each signature, can be called from Python, and do what their Python source does."""

from __future__ import annotations

from types import FunctionType

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import types
from numba.core.registry import CPUDispatcher

from predprey_env import EnvConfig
from predprey_env.config import TEAMS
from predprey_env.envs.turn import play_turn
from predprey_env.jit import rule
from predprey_env.policies.protocol import MEMORY, _begin
from predprey_env.policies.scripted import NUMBERS, Script, _act
from predprey_env.rules.dynamics import EVERYBODY, NOBODY, PREDATORS, PREY, World
from predprey_env.rules.starts import draw_starts


@rule
def weigh(a, b):
    """Return a sum with weights."""
    return 2 * a + b


@rule  # no entry point, whose machine code would come from the cache
def weigh_with_literals(a):
    """Call the rule with a number, and with several literals."""
    return weigh(a, a) + weigh(a, 1) + weigh(0, a) + weigh(1, 2)


def test_python_and_compiled_code_get_the_same_from_a_rule():
    assert weigh(3, 4) == weigh(3, b=4) == 10
    assert weigh_with_literals(3) == 9 + 7 + 3 + 4


def test_literal_integers_are_compiled_like_other_integers():
    weigh_with_literals(3)
    assert list(weigh.overloads) == [(types.int64, types.int64)]


def test_a_rule_that_only_compiled_code_calls_has_no_wrapper_for_python():
    weigh_with_literals(3)
    (compiled,) = weigh.overloads.values()
    names = {function.name for function in compiled.library.get_defined_functions()}
    assert names
    assert not any("cpython" in name or "cfunc" in name for name in names)


def test_a_rule_keeps_its_name_its_documentation_and_its_source():
    assert weigh.__name__ == "weigh"
    assert weigh.__doc__ == "Return a sum with weights."
    assert weigh.py_func(3, 4) == 10


def as_python(function: CPUDispatcher, known: dict[CPUDispatcher, FunctionType]) -> FunctionType:
    """The Python source of a compiled function, all compiled functions that it calls being Python too."""
    if function not in known:
        names = dict(function.py_func.__globals__)
        known[function] = FunctionType(function.py_func.__code__, names)
        for name in function.py_func.__code__.co_names:
            if isinstance(names.get(name), CPUDispatcher):
                names[name] = as_python(names[name], known)
    return known[function]


PYTHON = as_python(play_turn, {})


@given(config=st.from_type(EnvConfig), seed=st.integers(0, 2**32 - 1))
def test_compiled_rules_equal_their_python_source(config: EnvConfig, seed: int) -> None:
    random = np.random.default_rng(seed)
    x, y = draw_starts(random, 1, config)[0].T.copy()
    worlds = [World(x.copy(), y.copy(), np.ones(config.n_prey, np.int32)) for _ in range(2)]
    seen = np.empty((2, sum(shape.n_agents * shape.n_seen for shape in map(config.team, TEAMS))), np.float32)
    moved = np.zeros((2, config.n_agents), np.int32)
    scores = np.empty((2, config.n_agents))
    turns = [PREY, PREDATORS] * 10 if config.rules.prey_first else [EVERYBODY] * 15
    for steps, turn in enumerate([NOBODY, *turns]):
        actions = random.integers(0, 5, config.n_agents, np.int32)
        for advance, world, last, view, score in zip((play_turn, PYTHON), worlds, moved, seen, scores, strict=True):
            advance(world, last, actions, turn, steps, config.rules, view, score)
        compiled, python = worlds
        assert all(rows.tobytes() == others.tobytes() for rows, others in zip(compiled, python, strict=True))
        assert seen[0].tobytes() == seen[1].tobytes()
        assert scores[0].tobytes() == scores[1].tobytes()


@pytest.mark.filterwarnings("ignore:overflow encountered:RuntimeWarning")  # which the random script is built on
@pytest.mark.parametrize("in_turns", [False, True])
@pytest.mark.parametrize("n_actions", [4, 5])
@pytest.mark.parametrize("script", NUMBERS)
def test_compiled_scripts_equal_their_python_source(script: str, n_actions: int, in_turns: bool) -> None:
    python, random = as_python(_act, {}), np.random.default_rng(0)
    player, memories = Script(NUMBERS[script], 3, n_actions, in_turns), np.zeros((2, MEMORY), np.int32)
    for begin, memory in zip((_begin, as_python(_begin, {})), memories, strict=True):
        begin(memory, 5, True, 2)
    assert memories[0].tolist() == memories[1].tolist()
    seen = random.integers(-4, 5, 6).astype(np.float32)
    for _ in range(200):
        seen[random.integers(6)] += random.integers(-1, 2)  # by a step, as what moves is seen to
        actions = [act(player, 2, seen, memory) for act, memory in zip((_act, python), memories, strict=True)]
        assert actions[0] == actions[1]
        assert memories[0].tolist() == memories[1].tolist()
