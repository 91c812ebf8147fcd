"""An opponent that remembers is each environment's own, and can be changed."""

from __future__ import annotations

import copy
import pickle
import threading
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from esp_trainer import Team
from esp_trainer.config import SideConfig
from esp_trainer.esp.controller import make_controller, wiring_for
from predprey_env import EnvConfig, PredPreyVectorEnv, TeamView, team_view, vector_env
from predprey_env.policies import ScriptedTeam

WORLD = {"n_predators": 3, "n_prey": 2, "size": 20, "max_cycles": 30}


STARTS = [[0, 0], [0, 0], [0, 0], [10, 10], [15, 15]]


class Counter:
    """A step further round the compass each time, from where its seed says."""

    def __init__(self) -> None:
        self.count = 0

    def reset(self, seed: int | None = None) -> None:
        self.count = 0 if seed is None else seed

    def act(self, observations: dict[str, np.ndarray]) -> dict[str, int]:
        self.count += 1
        return {agent: (self.count + i) % 4 for i, agent in enumerate(observations)}


def drawn_team() -> Team:
    """Evolved prey whose actions are drawn."""
    shape, side = EnvConfig(**WORLD).team("prey"), SideConfig(choice="drawn")
    controller = make_controller(side, wiring_for(side, shape.n_opponents), shape.n_actions)
    genomes = np.random.default_rng(0).normal(size=(shape.n_agents, *controller.shape))
    return Team("prey", side, controller, genomes.astype(np.float32))


REMEMBERING: dict[str, Callable[[], Any]] = {
    "script": lambda: ScriptedTeam("random", "prey", n_actions=4),
    "evolved": drawn_team,
    "policy": Counter,
}


def walk(view: TeamView, n_steps: int) -> list[list[float]]:
    states = []
    for _ in range(n_steps):
        view.step(dict.fromkeys(view.agents, 4))
        states.append(view.state().tolist())
    return states


# -- an opponent of one's own -------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", REMEMBERING)
def test_two_views_of_one_opponent_do_not_disturb_each_other(kind: str) -> None:
    shared = REMEMBERING[kind]()
    alone, first, second = (team_view("predators", policy, **WORLD) for policy in (REMEMBERING[kind](), shared, shared))
    alone.reset(seed=5)
    expected = walk(alone, 12)
    first.reset(seed=5)
    begun = walk(first, 4)
    second.reset(seed=6)
    walk(second, 3)
    assert begun + walk(first, 8) == expected


def test_the_callers_policy_is_left_alone() -> None:
    policy = Counter()
    view, envs = team_view("predators", policy, **WORLD), vector_env(2, "predators", policy, **WORLD)
    view.reset(seed=1)
    walk(view, 2)
    envs.reset(seed=1)
    envs.step(np.zeros(6, int))
    assert policy.count == 0
    assert type(view.opponent) is Counter
    assert view.opponent.count > 0


def test_copies_of_a_view_have_an_opponent_of_their_own() -> None:
    view = team_view("predators", Counter(), **WORLD)
    view.reset(seed=5)
    for twin in (copy.deepcopy(view), pickle.loads(pickle.dumps(view))):
        states = walk(twin, 5)
        assert walk(copy.deepcopy(view), 5) == states


class Locked(Counter):
    """Cannot be copied."""

    def __init__(self) -> None:
        super().__init__()
        self.lock = threading.Lock()


@pytest.mark.parametrize("make", [team_view, lambda *args, **world: vector_env(2, *args, **world)])
def test_a_policy_that_cannot_be_copied_is_refused_with_what_to_do(make: Any) -> None:
    policy = Locked()
    with pytest.raises(ValueError) as refused:  # noqa: PT011  # the whole text is compared
        make("predators", policy, **WORLD)
    reason, remedy = str(refused.value).split("; ")
    assert reason == (
        "the opponent's memory cannot be copied for each world: TypeError: cannot pickle '_thread.lock' object"
    )
    assert remedy == "give it a __deepcopy__(), or give a function that calls its act(), which all worlds share"
    make("predators", lambda seen: policy.act(seen), **WORLD).reset(seed=1)


class Batch(Locked):
    """Says that it remembers nothing."""

    def act_batch(self, observations: np.ndarray) -> np.ndarray:
        return np.zeros(observations.shape[:2], int)


def test_a_policy_that_remembers_nothing_is_shared() -> None:
    policy = Batch()
    assert team_view("predators", policy, **WORLD).opponent is policy
    assert vector_env(2, "predators", policy, **WORLD).opponent is policy


class Learner(Locked):
    """Learns a direction while it plays, and cannot be copied."""

    direction = 0

    def act(self, observations: dict[str, np.ndarray]) -> dict[str, int]:
        return dict.fromkeys(observations, self.direction)

    __call__ = act

    def play(self, _note: str, observations: dict[str, np.ndarray]) -> dict[str, int]:
        return self.act(observations)


class Called:
    """The same, but no policy."""

    def __init__(self, learner: Learner) -> None:
        self.learner = learner

    def __call__(self, observations: dict[str, np.ndarray]) -> dict[str, int]:
        return self.learner.act(observations)


@pytest.mark.parametrize(
    "function",
    [lambda learner: learner.act, lambda learner: partial(learner.play, "note"), Called],
    ids=["bound method", "partial", "callable"],
)
def test_a_function_is_asked_as_it_is_at_each_step(function: Any) -> None:
    learner = Learner()
    view = team_view("predators", function(learner), **WORLD)
    envs = vector_env(2, "predators", "random", **WORLD)
    envs.set_opponent(function(learner))
    view.reset(options={"starts": STARTS})
    seen, _ = envs.reset(options={"starts": [STARTS] * 2})
    for learner.direction, way in ((0, [1, 0]), (3, [0, -1])):
        before, old = view.state(), seen
        view.step(dict.fromkeys(view.agents, 4))
        assert (view.state() - before)[[3, 8]].tolist() == way
        seen, *_ = envs.step(np.full(6, 4))
        assert (seen - old)[:, 2:].tolist() == [way] * 6


# -- another opponent ---------------------------------------------------------------------------------------------


def run(direction: int) -> Callable[[dict[str, np.ndarray]], dict[str, int]]:
    return lambda views: dict.fromkeys(views, direction)


def test_a_views_opponent_is_changed_from_the_next_step_on() -> None:
    view = team_view("predators", run(0), **WORLD)
    view.set_opponent(run(2))
    view.reset(options={"starts": STARTS})
    walk(view, 1)
    view.set_opponent(run(1))
    (state,) = walk(view, 1)
    assert [state[i] for i in (3, 4, 8, 9)] == [9, 14, 11, 16]  # columns, rows
    view.reset(options={"starts": STARTS})
    (state,) = walk(view, 1)
    assert [state[i] for i in (3, 4, 8, 9)] == [9, 14, 10, 15]


@pytest.mark.parametrize("mode", list(AutoresetMode))
@pytest.mark.parametrize(
    ("old", "new"),
    [
        (run(0), run(2)),
        ("flee_nearest", run(2)),
        (run(0), "random"),
        ("random", "flee_nearest"),
        (Counter(), Counter()),
    ],
)
def test_another_opponent_plays_on_in_all_worlds_as_if_it_always_had(old: Any, new: Any, mode: AutoresetMode) -> None:
    """One that was there from the beginning, and was reset with the same seeds."""
    envs, expected = vector_env(3, "predators", old, mode, **WORLD), vector_env(3, "predators", new, mode, **WORLD)
    starts = [STARTS] * 3
    envs.reset(seed=5, options={"starts": starts})
    envs.set_opponent(new)
    expected.reset(seed=5, options={"starts": starts})
    expected.set_opponent(new)
    for _ in range(5):
        assert envs.step(np.full(9, 4))[0].tolist() == expected.step(np.full(9, 4))[0].tolist()
    assert envs.np_random[0].integers(99) == expected.np_random[0].integers(99)


def test_an_opponent_changed_before_the_first_reset_is_as_good_as_given() -> None:
    envs, given = vector_env(3, "predators", "flee_nearest", **WORLD), vector_env(3, "predators", Counter(), **WORLD)
    envs.set_opponent(Counter())
    assert envs.reset(seed=2)[0].tolist() == given.reset(seed=2)[0].tolist()
    for _ in range(40):
        assert envs.step(np.full(9, 1))[0].tolist() == given.step(np.full(9, 1))[0].tolist()


class FailsToReset(Counter):
    def reset(self, seed: int | None = None) -> None:
        raise OSError("the line is down")


UNFIT = [
    ("surround", ValueError, "^script must be one of "),
    (ScriptedTeam("surround"), ValueError, "^expected prey, got surround, a script of predators$"),
    (Counter, ValueError, "^opponent must be an object, got the class Counter"),
    (Locked(), ValueError, "^the opponent's memory cannot be copied for each world"),
    (FailsToReset(), OSError, "^the line is down$"),
]


@pytest.mark.parametrize(("unfit", "error", "line"), UNFIT)
@pytest.mark.parametrize("old", ["random", Counter()])
def test_an_opponent_that_cannot_play_leaves_the_old_one(
    old: Any, unfit: Any, error: type[Exception], line: str, same_future: Callable[..., bool]
) -> None:
    env, twin = (vector_env(2, "predators", old, "SameStep", **WORLD) for _ in range(2))
    for each in (env, twin):
        each.reset(seed=4)
        each.step(np.ones(6, int))
    before = env.opponent
    with pytest.raises(error, match=line):
        env.set_opponent(unfit)
    assert env.opponent is before
    assert same_future(env, twin, 60)


@pytest.mark.parametrize(("unfit", "error", "line"), UNFIT)
def test_an_opponent_that_cannot_play_leaves_a_views_old_one(unfit: Any, error: type[Exception], line: str) -> None:
    view, twin = (team_view("predators", Counter(), **WORLD) for _ in range(2))
    for each in (view, twin):
        each.reset(seed=4)
    before = view.opponent
    with pytest.raises(error, match=line):
        view.set_opponent(unfit)
    assert view.opponent is before
    assert walk(view, 5) == walk(twin, 5)
    assert [seen.tolist() for seen in view.reset()[0].values()] == [seen.tolist() for seen in twin.reset()[0].values()]


def test_a_changed_opponent_is_kept_by_copies() -> None:
    envs = PredPreyVectorEnv(EnvConfig(**WORLD), 2, "predators", "random")
    envs.reset(seed=1)
    envs.set_opponent(Counter())
    for twin in (copy.deepcopy(envs), pickle.loads(pickle.dumps(envs))):
        assert type(twin.opponent) is Counter
        assert twin.step(np.zeros(6, int))[0].tolist() == copy.deepcopy(envs).step(np.zeros(6, int))[0].tolist()
