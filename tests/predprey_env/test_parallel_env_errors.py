"""Mistakes of the caller: one line that says what was expected and what came, and a world left as it was."""

from __future__ import annotations

import pytest

from predprey_env import EnvConfig, PredPreyEnv

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


@pytest.mark.parametrize("actions", [None, [4, 1, 2], 3, {0: 4, "predator_1": 1}])
def test_actions_that_are_no_dictionary_of_agents_are_refused_in_one_line(actions: object) -> None:
    env, twin = twins()
    with pytest.raises(ValueError, match=r"^[^\n]*action[^\n]*$"):
        env.step(actions)
    assert same_future(env, twin)


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
