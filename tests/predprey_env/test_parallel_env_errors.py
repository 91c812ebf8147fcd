"""Mistakes of the caller: one line that says what was expected and what came, and a world left as it was."""

from __future__ import annotations

from types import MappingProxyType

import numpy as np
import pytest

from predprey_env import EnvConfig, PredPreyEnv, predprey_v0, team_view, vector_env

CONFIG = EnvConfig(n_predators=2, n_prey=1, size=20)
GOOD = {"predator_0": 4, "predator_1": 1, "prey_0": 2}


def twins() -> tuple[PredPreyEnv, PredPreyEnv]:
    envs = PredPreyEnv(CONFIG), PredPreyEnv(CONFIG)
    for env in envs:
        env.reset(seed=0)
        env.step(GOOD)
    return envs


def same_future(env: PredPreyEnv, twin: PredPreyEnv) -> bool:
    """Whether two environments play on alike, through the next random start."""
    states = []
    for each in (env, twin):
        each.step(GOOD)
        states.append([each.state().tobytes()])
        each.reset()
        states[-1].append(each.state().tobytes())
    return states[0] == states[1]


@pytest.mark.parametrize(
    ("fields", "line"),
    [
        ({"size": 0}, "size must be at least 3, got 0"),
        ({"size": 1}, "size must be at least 3, got 1"),
        ({"size": 2}, "size must be at least 3, got 2"),
        ({"size": 3, "n_predators": 4, "n_prey": 6}, "10 agents need at least as many cells, got size=3"),
        ({"size": 3, "n_predators": 5, "n_prey": 1}, "5 predators need twice as many cells, got size=3"),
        ({"max_cycles": 0}, "max_cycles must be at least 1, got 0"),
        ({"n_prey": 0}, "n_prey must be at least 1, got 0"),
        ({"cells": 9}, "unknown field cells"),
    ],
)
def test_a_world_that_cannot_be_is_refused_by_all_who_make_one(fields: dict[str, int], line: str) -> None:
    makers = [
        lambda: PredPreyEnv(EnvConfig(**fields)),
        lambda: team_view("prey", "random", **fields),
        lambda: vector_env(2, "prey", "random", **fields),
    ]
    if "cells" not in fields:  # which is Python's own to refuse where parameters are named one by one
        makers += [lambda: predprey_v0.parallel_env(**fields), lambda: predprey_v0.env(**fields)]
    for make in makers:
        with pytest.raises(ValueError) as refused:  # noqa: PT011
            make()
        assert str(refused.value) == line


@pytest.mark.parametrize("fields", [{"size": 3, "n_predators": 4, "n_prey": 5}, {"size": 3, "max_cycles": 1}])
def test_the_smallest_worlds_are_played(fields: dict[str, int]) -> None:
    env = PredPreyEnv(EnvConfig(**fields))
    for seed in range(20):
        env.reset(seed=seed)
        while env.agents:
            env.step(dict.fromkeys(env.agents, 1))
        assert env.state() in env.state_space


@pytest.mark.parametrize("method", ["step", "state", "render"])
def test_nothing_works_before_the_first_reset(method: str) -> None:
    env = PredPreyEnv(CONFIG, "ansi")
    with pytest.raises(RuntimeError) as refused:
        getattr(env, method)(*([GOOD] if method == "step" else []))
    assert str(refused.value) == f"reset() must be called before {method}()"


def test_an_unknown_render_mode_is_refused() -> None:
    with pytest.raises(ValueError, match=r"^render_mode must be None or one of human, ansi, rgb_array, got 'rgb'$"):
        PredPreyEnv(CONFIG, "rgb")


@pytest.mark.parametrize(
    ("actions", "line"),
    [
        ({"predator_0": 4}, "an action for predator_1 is missing; got actions for ['predator_0']"),
        ({}, "an action for predator_0 is missing; got actions for []"),
        (GOOD | {"predator_0": 5}, "the action of predator_0 must be in 0..4, got 5"),
        (GOOD | {"predator_1": -1}, "the action of predator_1 must be in 0..4, got -1"),
        (GOOD | {"prey_0": 4}, "the action of prey_0 must be in 0..3, got 4"),
        (GOOD | {"prey_0": 2**70}, f"the action of prey_0 must be in 0..3, got {2**70}"),
        (GOOD | {"prey_0": 1.0}, "the action of prey_0 must be an integer, got 1.0"),
        (GOOD | {"prey_0": float("nan")}, "the action of prey_0 must be an integer, got nan"),
        (GOOD | {"prey_0": "2"}, "the action of prey_0 must be an integer, got '2'"),
        (GOOD | {"prey_0": None}, "the action of prey_0 must be an integer, got None"),
        (GOOD | {"prey_0": [1, 2]}, "the action of prey_0 must be an integer, got [1, 2]"),
    ],
)
def test_a_bad_action_is_named_and_does_no_harm(actions: dict[str, object], line: str) -> None:
    env, twin = twins()
    with pytest.raises(ValueError) as refused:  # noqa: PT011  # the whole text is compared
        env.step(actions)
    assert str(refused.value) == line
    assert same_future(env, twin)


@pytest.mark.parametrize("actions", [None, [4, 1, 2], 3, "predator_0", (), {"predator_0", "predator_1", "prey_0"}])
def test_actions_that_are_no_mapping_are_refused(actions: object) -> None:
    env, twin = twins()
    with pytest.raises(ValueError) as refused:  # noqa: PT011
        env.step(actions)
    assert str(refused.value) == f"actions must be a mapping from agents to actions, got {actions!r}"
    assert same_future(env, twin)


@pytest.mark.parametrize("agent", ["prey_1", "predator_2", "prey", "Prey_0", "wolf", 0, None, ("prey_0",)])
def test_actions_for_an_agent_that_is_none_are_refused(agent: object) -> None:
    env, twin = twins()
    for actions in (GOOD | {agent: 1}, {agent: 1} | GOOD, {agent: None}):
        with pytest.raises(ValueError) as refused:  # noqa: PT011
            env.step(actions)
        assert str(refused.value) == f"actions must be for predator_0, predator_1, prey_0, got one for {agent!r}"
    assert same_future(env, twin)


@pytest.mark.parametrize("actions", [np.zeros((3, 2)), [0] * 500, GOOD | {"prey_0": np.zeros((2, 2))}])
def test_arrays_for_actions_are_refused_in_one_short_line(actions: object) -> None:
    env, twin = twins()
    with pytest.raises(ValueError, match=r"\A[^\n]*action[^\n]*\Z") as refused:
        env.step(actions)
    assert len(str(refused.value)) < 200
    assert same_future(env, twin)


def test_actions_of_agents_that_left_are_known_and_ignored() -> None:
    env = PredPreyEnv(EnvConfig(n_predators=1, n_prey=2, size=8, captured_prey="removed"))
    env.reset(options={"starts": [[0, 0], [2, 0], [4, 4]]})
    env.step({"predator_0": 0, "prey_0": 1, "prey_1": 0})
    assert env.agents == ["predator_0", "prey_1"]
    env.step({"predator_0": 4, "prey_0": 99, "prey_1": 0})
    assert env.state().tolist()[:6] == [1, 1, 6, 0, 0, 4]


def test_any_mapping_will_do() -> None:
    env, twin = twins()
    env.step(MappingProxyType(GOOD))
    twin.step(GOOD)
    assert same_future(env, twin)


@pytest.mark.parametrize("move_order", ["simultaneous", "prey_first"])
def test_a_mistake_after_good_actions_takes_none_of_them(move_order: str) -> None:
    """The actions are read one by one; the world moves when all are good."""
    envs = [PredPreyEnv(CONFIG.replace(move_order=move_order, n_prey=2)) for _ in range(2)]
    for env in envs:
        env.reset(seed=1)
    good = GOOD | {"prey_1": 3}
    with pytest.raises(ValueError, match=r"^the action of prey_1 must be in 0\.\.3, got 9$"):
        envs[0].step(GOOD | {"prey_0": 0, "prey_1": 9})
    for _ in range(4):
        for env in envs:
            env.step(good)
        assert envs[0].state().tolist() == envs[1].state().tolist()


@pytest.mark.parametrize(
    ("starts", "line"),
    [
        ([(0, 0)] * 2, "starts must be integers of shape (3, 2), got int64 of shape (2, 2)"),
        ([(0, 0, 0)] * 3, "starts must be integers of shape (3, 2), got int64 of shape (3, 3)"),
        ([(0.0, 1.0)] * 3, "starts must be integers of shape (3, 2), got float64 of shape (3, 2)"),
        ([(float("nan"), 1)] * 3, "starts must be integers of shape (3, 2), got float64 of shape (3, 2)"),
        ([(True, False)] * 3, "starts must be integers of shape (3, 2), got bool of shape (3, 2)"),
        ("here", "starts must be integers of shape (3, 2), got <U4 of shape ()"),
        ([(0, 0), (1, 1), (2, 20)], "starts must lie in [0, 20), got 0 to 20"),
        ([(0, 0), (1, 1), (2, -1)], "starts must lie in [0, 20), got -1 to 2"),
        ([(0, 0), (1, 1), (2, 2**32)], f"starts must lie in [0, 20), got 0 to {2**32}"),
    ],
)
def test_bad_starts_are_described_and_do_no_harm(starts: object, line: str) -> None:
    env, twin = twins()
    with pytest.raises(ValueError) as refused:  # noqa: PT011
        env.reset(options={"starts": starts})
    assert str(refused.value) == line
    assert same_future(env, twin)


def test_ragged_starts_are_refused_as_starts() -> None:
    env, twin = twins()
    with pytest.raises(ValueError, match=r"^starts must [^\n]*$"):
        env.reset(options={"starts": [(0, 0), (1, 1), (2,)]})
    assert same_future(env, twin)


def test_a_refused_reset_does_not_seed() -> None:
    env, twin = twins()
    with pytest.raises(ValueError, match="starts"):
        env.reset(seed=9, options={"starts": [(0, 0)]})
    assert same_future(env, twin)


@pytest.mark.parametrize("seed", [-1, 1.5, "3", [1]])
def test_a_seed_that_is_none_is_refused_and_does_no_harm(seed: object) -> None:
    env, twin = twins()
    with pytest.raises(Exception, match=r"\A[^\n]*\Z"):  # Python's and gymnasium's own
        env.reset(seed=seed)
    assert same_future(env, twin)
