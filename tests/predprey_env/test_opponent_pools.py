"""Pools of opponents: each episode samples one, in a team view and in a vector environment alike."""

from __future__ import annotations

import re
from collections import Counter
from typing import Any

import numpy as np
import pytest

from predprey_env import OpponentPool, ScriptedTeam, team_view, vector_env


class Circling:
    """A policy in Python with a memory: east, west, north, south, and again."""

    def __init__(self) -> None:
        self.n_steps = 0

    def reset(self, seed: int | None = None) -> None:
        self.n_steps = 0

    def act(self, observations: dict[str, np.ndarray]) -> dict[str, int]:
        self.n_steps += 1
        return dict.fromkeys(observations, self.n_steps % 4)


class Eastward:
    """A policy that is asked about all worlds at once."""

    def reset(self, seed: int | None = None) -> None:
        pass

    def act(self, observations: dict[str, np.ndarray]) -> dict[str, int]:
        return dict.fromkeys(observations, 0)

    def act_batch(self, observations: np.ndarray) -> np.ndarray:
        return np.zeros(observations.shape[:2], np.int64)


class Failing(Circling):
    """A policy that raises in its third step."""

    def act(self, observations: dict[str, np.ndarray]) -> dict[str, int]:
        if self.n_steps == 2:
            raise ArithmeticError("no more")
        return super().act(observations)


def pool() -> OpponentPool:
    return OpponentPool(["flee_nearest", Circling(), "run_straight", Eastward()], weights=[1, 2, 1, 0.5])


@pytest.mark.parametrize("order", ["simultaneous", "prey_first"])
def test_a_vector_environment_plays_the_same_opponents_as_team_views(order: Any) -> None:
    world: dict[str, Any] = {"n_prey": 1, "size": 9, "max_cycles": 20, "move_order": order}
    n, met = 5, Counter[int]()
    envs = vector_env(n, "predators", pool(), "SameStep", **world)
    singles = [team_view("predators", pool(), **world) for _ in range(n)]
    seen, infos = envs.reset(seed=3)
    now = [single.reset(seed=3 + w) for w, single in enumerate(singles)]
    generator = np.random.default_rng(0)
    for _ in range(120):
        for w, (own, told) in enumerate(now):
            assert (seen.reshape(n, 3, -1)[w] == np.stack(list(own.values()))).all()
            assert set(infos["opponent"].reshape(n, 3)[w]) == {info["opponent"] for info in told.values()}
        actions = generator.integers(0, 5, (n, 3))
        seen, rewards, *_, infos = envs.step(actions.ravel())
        for w, single in enumerate(singles):
            step = single.step({f"predator_{i}": int(actions[w, i]) for i in range(3)})
            assert rewards.reshape(n, 3)[w].tolist() == list(step[1].values())
            now[w] = step[0], step[4]
            if not single.agents:
                last = step[4]["predator_0"]["opponent"]
                assert infos["final_info"]["opponent"].reshape(n, 3)[w].tolist() == [last] * 3
                met[last] += 1
                now[w] = single.reset()
    assert set(met) == {0, 1, 2, 3}


def test_a_pool_of_one_plays_as_the_opponent_alone() -> None:
    alone, pooled = (vector_env(3, "predators", each, n_prey=1, size=8) for each in ("random", ["random"]))
    seen = [envs.reset(seed=1)[0] for envs in (alone, pooled)]
    for _ in range(20):
        assert (seen[0] == seen[1]).all()
        (seen_0, *_, infos), (seen_1, *_) = (envs.step(np.full(9, 4)) for envs in (alone, pooled))
        seen = [seen_0, seen_1]
        assert "opponent" not in infos
    assert isinstance(pooled.opponent, ScriptedTeam)


def test_opponents_are_sampled_by_their_weights() -> None:
    shares = OpponentPool(["random", "flee_nearest", "run_straight"], weights=[3, 0, 1])
    generator = np.random.default_rng(0)
    met = Counter(shares.sample(generator) for _ in range(4000))
    assert set(met) == {0, 2}
    assert met[0] / 4000 == pytest.approx(0.75, abs=0.03)


def test_a_pool_replaces_the_opponents_during_an_episode() -> None:
    envs = vector_env(64, "predators", "run_straight", n_prey=1, size=20)
    envs.reset(seed=0)
    envs.step(np.full(192, 4))
    envs.set_opponent(["flee_nearest", "flee_centroid", Circling()])
    assert [type(each).__name__ for each in envs.opponent] == ["ScriptedTeam", "ScriptedTeam", "Circling"]
    *_, infos = envs.step(np.full(192, 4))
    assert set(infos["opponent"]) == {0, 1, 2}
    view = team_view("predators", "run_straight", n_prey=1)
    view.reset(seed=0)
    view.set_opponent(OpponentPool(["random", "flee_nearest"], [0, 1]))
    assert view.step(dict.fromkeys(view.agents, 4))[4]["predator_0"]["opponent"] == 1


def test_a_member_that_fails_leaves_all_worlds_as_they_were() -> None:
    envs = vector_env(8, "predators", ["flee_nearest", Failing()], n_prey=1, size=20)
    envs.reset(seed=0)
    for _ in range(2):
        envs.step(np.full(24, 4))
    before = [array.copy() for array in envs._worlds.arrays()]
    with pytest.raises(RuntimeError, match=r"^the opponent's act\(\) raised ArithmeticError: no more$"):
        envs.step(np.zeros(24, np.int64))
    assert all((array == old).all() for array, old in zip(envs._worlds.arrays(), before, strict=True))
    with pytest.raises(ValueError, match="script must be one of"):
        envs.set_opponent(["flee_nearest", "surround"])
    assert [type(each).__name__ for each in envs.opponent] == ["ScriptedTeam", "Failing"]


@pytest.mark.parametrize(
    ("opponents", "weights", "says"),
    [
        ([], None, "a pool needs at least one opponent, got none"),
        (["random"], [1, 2], "weights must be 1 numbers, one for each opponent, got [1, 2]"),
        (["random"], ["heavy"], "weights must be numbers, got ['heavy']"),
        (["random", "random"], [1, -1], "weights must be finite, at least 0 and not all 0, got [1, -1]"),
        (["random"], [0], "weights must be finite, at least 0 and not all 0, got [0]"),
        (["random"], [float("nan")], "weights must be finite, at least 0 and not all 0, got [nan]"),
    ],
)
def test_a_pool_that_cannot_be_sampled_is_refused(opponents: Any, weights: Any, says: str) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(says)}$"):
        OpponentPool(opponents, weights)
