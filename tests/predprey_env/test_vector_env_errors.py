"""Mistakes of the caller: one line each, and the worlds left as they were. The opponents' are in
test_vector_env_opponent_errors.py.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from predprey_env import PredPreyVectorEnv, team_view, vector_env
from predprey_env.config import TEAMS, TeamName
from predprey_env.settings import plain

SMALL = {"n_predators": 2, "n_prey": 2, "size": 7, "max_cycles": 6, "reward": "dense"}
TEAM = pytest.mark.parametrize("team", TEAMS)
ORDER = pytest.mark.parametrize("move_order", ["simultaneous", "prey_first"])
ONE_LINE = r"\A[^\n]*\Z"


def twins(team: TeamName = "prey", **rules: Any) -> list[PredPreyVectorEnv]:
    envs = [vector_env(3, team, "random", **SMALL | rules) for _ in range(2)]
    for env in envs:
        env.reset(seed=4)
        env.step(np.ones(6, int))
    return envs


# -- making one ---------------------------------------------------------------------------------------------------


def test_where_nothing_is_compiled_one_line_names_the_variable_and_single_worlds_play() -> None:
    program = (
        "from predprey_env import team_view, vector_env\n"
        "for opponent in ('greedy_chase', 'random'):\n"
        "    env = team_view('prey', opponent, size=7)\n"
        "    env.reset(seed=0)\n"
        "    for _ in range(9):\n"
        "        env.step(dict.fromkeys(env.agents, 1))\n"
        "    print(env.state().tolist())\n"
        "try:\n"
        "    vector_env(3, 'prey', 'random', size=7).reset()\n"
        "except ValueError as error:\n"
        "    print(error)\n"
    )
    uncompiled = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, env=uncompiled)
    assert (done.returncode, done.stderr) == (0, "")
    *states, line = done.stdout.splitlines()
    for opponent, state in zip(("greedy_chase", "random"), states, strict=True):
        env = team_view("prey", opponent, size=7)
        env.reset(seed=0)
        for _ in range(9):
            env.step(dict.fromkeys(env.agents, 1))
        assert state == str(env.state().tolist())
    assert line == (
        "NUMBA_DISABLE_JIT must be unset to play many worlds at a time; only parallel_env, env and team_view play "
        "uncompiled"
    )


@pytest.mark.parametrize("n_worlds", [0, -3, 2.0, "2", True, np.float64(2), np.bool_(True)])
def test_a_number_of_worlds_that_is_none_is_refused(n_worlds: Any) -> None:
    with pytest.raises(ValueError) as refused:  # noqa: PT011  # the whole text is compared
        vector_env(n_worlds, "prey", "random")
    assert str(refused.value) == f"n_worlds must be an integer of at least 1, got {plain(n_worlds)!r}"
    with pytest.raises(ValueError, match=r"^num_envs must be an integer of at least 1, got "):
        vector_env(team="prey", opponent="random", num_envs=n_worlds)


@pytest.mark.parametrize(
    ("arguments", "rules", "line"),
    [
        (("birds", "random"), {}, "team must be predators or prey, got 'birds'"),
        (
            ("prey", "random"),
            {"captured_prey": "removed"},
            "in a vector env captured_prey must be 'inert', as no row may leave, got 'removed'",
        ),
        (
            ("prey", "random", "Sometimes"),
            {},
            "autoreset_mode must be one of NextStep, SameStep, Disabled, got 'Sometimes'",
        ),
        (("prey", "random"), {"size": 2}, "size must be at least 3, got 2"),
        (("prey", "random"), {"sise": 5}, "unknown field sise; did you mean size?"),
    ],
)
def test_bad_parameters_are_refused_in_one_line(arguments: tuple[Any, ...], rules: dict[str, Any], line: str) -> None:
    with pytest.raises(ValueError) as refused:  # noqa: PT011
        vector_env(2, *arguments, **rules)
    assert str(refused.value) == line


# -- order of calls -----------------------------------------------------------------------------------------------


def test_nothing_works_before_the_first_reset() -> None:
    env = vector_env(3, "prey", "random", **SMALL)
    with pytest.raises(RuntimeError, match=r"^reset\(\) must be called before step\(\)$"):
        env.step(np.zeros(6, int))
    mask = np.array([True, True, False, False, False, False])
    with pytest.raises(RuntimeError, match=r"^reset\(\) must be called without a reset_mask first$"):
        env.reset(options={"reset_mask": mask})
    with pytest.raises(RuntimeError, match=r"^reset\(\) must be called before step\(\)$"):
        env.step(np.zeros(6, int))


# -- actions ------------------------------------------------------------------------------------------------------


@ORDER
@TEAM
@pytest.mark.parametrize(
    ("actions", "line"),
    [
        (np.zeros(3, int), "actions must be integers of shape (6,), got int64 of shape (3,)"),
        (np.zeros((3, 2), int), "actions must be integers of shape (6,), got int64 of shape (3, 2)"),
        (np.zeros(6), "actions must be integers of shape (6,), got float64 of shape (6,)"),
        (np.full(6, np.nan), "actions must be integers of shape (6,), got float64 of shape (6,)"),
        (np.zeros(6, bool), "actions must be integers of shape (6,), got bool of shape (6,)"),
        (None, "actions must be integers of shape (6,), got object of shape ()"),
        ([0, 0, None, 0, 0, 0], "actions must be integers of shape (6,), got object of shape (6,)"),
        ("000000", "actions must be integers of shape (6,), got <U6 of shape ()"),
        ({"prey_0": 1}, "actions must be integers of shape (6,), got object of shape ()"),
        ([0, 0, 0, 0, 0, 5], "actions must be in 0..MOST, got 0 to 5"),
        ([0, 0, -1, 0, 0, 0], "actions must be in 0..MOST, got -1 to 0"),
        (np.array([0, 0, 0, 0, 0, 2**64 - 1], np.uint64), f"actions must be in 0..MOST, got 0 to {2**64 - 1}"),
    ],
)
def test_bad_actions_are_described_and_do_no_harm(
    team: TeamName, move_order: str, actions: Any, line: str, same_future: Callable[..., bool]
) -> None:
    env, twin = twins(team, move_order=move_order)
    with pytest.raises(ValueError) as refused:  # noqa: PT011
        env.step(actions)
    assert str(refused.value) == line.replace("MOST", "4" if team == "predators" else "3")
    assert same_future(env, twin)


@pytest.mark.parametrize("actions", [[[0], [0, 1], 0, 0, 0, 0], [[0] * 6, [0] * 5]])
def test_ragged_actions_are_refused_in_one_line(actions: Any, same_future: Callable[..., bool]) -> None:
    env, twin = twins()
    with pytest.raises(ValueError, match=ONE_LINE):
        env.step(actions)
    assert same_future(env, twin)


# -- reset --------------------------------------------------------------------------------------------------------


CELLS = [[[0, 0], [1, 1], [2, 2], [3, 3]]] * 3


@pytest.mark.parametrize(
    ("options", "line"),
    [
        ({"starts": CELLS[:2]}, "starts must be integers of shape (3, 4, 2), got int64 of shape (2, 4, 2)"),
        ({"starts": CELLS[0]}, "starts must be integers of shape (3, 4, 2), got int64 of shape (4, 2)"),
        (
            {"starts": [*CELLS[:2], CELLS[0][:3]]},
            "starts must be integers of shape (3, 4, 2), got rows of unequal length",
        ),
        (
            {"starts": np.array(CELLS, float)},
            "starts must be integers of shape (3, 4, 2), got float64 of shape (3, 4, 2)",
        ),
        ({"starts": np.array(CELLS) + 4}, "starts must lie in [0, 7), got 4 to 7"),
        ({"starts": np.array(CELLS) - 1}, "starts must lie in [0, 7), got -1 to 2"),
        ({"reset_mask": np.zeros(3, bool)}, "reset_mask must be bool of shape (6,), got bool of shape (3,)"),
        ({"reset_mask": np.ones(6, int)}, "reset_mask must be bool of shape (6,), got int64 of shape (6,)"),
        ({"reset_mask": True}, "reset_mask must be bool of shape (6,), got bool of shape ()"),
        (
            {"reset_mask": np.array([True, False, False, False, True, True])},
            "reset_mask must mark all agents of a world or none, as they end together",
        ),
    ],
)
def test_bad_options_are_described_and_do_no_harm(
    options: dict[str, Any], line: str, same_future: Callable[..., bool]
) -> None:
    env, twin = twins()
    with pytest.raises(ValueError) as refused:  # noqa: PT011
        env.reset(seed=9, options=options)
    assert str(refused.value) == line
    assert same_future(env, twin)


@pytest.mark.parametrize("seed", [[1, 2], [1, 2, 3, 4], [1] * 6, []])
def test_seeds_are_one_for_each_world(seed: list[int], same_future: Callable[..., bool]) -> None:
    env, twin = twins()
    line = f"^seed must be an integer or one for each of 3 worlds, got {len(seed)}$"
    with pytest.raises(ValueError, match=line):
        env.reset(seed=seed)
    assert same_future(env, twin)


@pytest.mark.parametrize("seed", [-1, 1.5, "123", [1.5, 2, 3]])
def test_a_seed_that_is_none_is_refused_in_one_line(seed: Any, same_future: Callable[..., bool]) -> None:
    env, twin = twins()
    with pytest.raises(Exception, match=ONE_LINE):  # gymnasium's own, as in a single environment
        env.reset(seed=seed)
    assert same_future(env, twin)


@pytest.mark.parametrize("seed", [[5, 6, -1], [5, 6, "7"]])
def test_a_bad_seed_seeds_nobody(seed: Any, same_future: Callable[..., bool]) -> None:
    env, twin = twins()
    with pytest.raises(Exception, match=ONE_LINE):
        env.reset(seed=seed)
    assert same_future(env, twin)
