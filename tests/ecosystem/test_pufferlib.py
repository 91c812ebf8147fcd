"""PufferLib: its emulation of PettingZoo and Gymnasium in its vector environments, from `pufferlib-core`.

PufferLib 3.0.0 itself asks for PettingZoo 1.24.1 and fetches a graphics library while it is built.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pufferlib.vector
import pytest
import supersuit as ss
from pufferlib.emulation import GymnasiumPufferEnv, PettingZooPufferEnv

from predprey_env import joint_env, parallel_env, vector_env

pytestmark = pytest.mark.ecosystem


def test_the_snippet_plays_the_same_episodes_as_the_vector_environment(snippet: dict[str, Any]) -> None:
    theirs = snippet["envs"]
    world = {"opponent": "flee_nearest", "size": 7, "n_prey": 1, "reward": "dense"}
    ours = vector_env(8, "predators", autoreset_mode="NextStep", **world)
    np.testing.assert_array_equal(theirs.reset(seed=5)[0], ours.reset(seed=5)[0])
    random, n_caught, n_late = np.random.default_rng(0), 0, 0
    for _ in range(400):
        actions = random.integers(5, size=24)
        observations, rewards, terminated, truncated, _ = theirs.step(actions)
        expected = ours.step(actions)
        np.testing.assert_array_equal(observations, expected[0])
        np.testing.assert_array_equal(rewards, np.float32(expected[1]))
        np.testing.assert_array_equal(terminated, expected[2])
        np.testing.assert_array_equal(truncated, expected[3])
        n_caught, n_late = n_caught + terminated.sum() // 3, n_late + truncated.sum() // 3
    assert n_caught > 0
    assert n_late > 0


def test_both_teams_play_with_padded_spaces() -> None:
    def make_env(buf: Any = None, seed: int = 0) -> PettingZooPufferEnv:
        padded = ss.pad_action_space_v0(ss.pad_observations_v0(parallel_env(size=7, reward="dense")))
        return PettingZooPufferEnv(padded, buf=buf, seed=seed)

    envs = pufferlib.vector.make(make_env, num_envs=2, backend=pufferlib.vector.Serial)
    observations, _ = envs.reset(seed=0)
    assert observations.shape == (10, 6)
    expected, _ = parallel_env(size=7, reward="dense").reset(seed=0)
    for row, (agent, seen) in zip(observations, expected.items(), strict=False):
        np.testing.assert_array_equal(row[: len(seen)], seen, agent)
        assert not row[len(seen) :].any()
    for _ in range(200):
        rewards = envs.step(envs.action_space.sample())[1].reshape(2, 5)
        assert (rewards[:, 0] == rewards[:, 1]).all(), "predators share their rewards"


def test_a_team_as_one_agent_plays() -> None:
    def make_env(buf: Any = None, seed: int = 0) -> GymnasiumPufferEnv:
        return GymnasiumPufferEnv(joint_env("prey", size=7, reward="dense"), buf=buf, seed=seed)

    envs = pufferlib.vector.make(make_env, num_envs=2, backend=pufferlib.vector.Serial)
    observations, _ = envs.reset(seed=3)
    np.testing.assert_array_equal(observations[1], joint_env("prey", size=7, reward="dense").reset(seed=4)[0])
    n_steps = [info["steps"] for _ in range(200) for info in envs.step(envs.action_space.sample())[-1]]
    assert max(n_steps) <= 150
    assert n_steps.count(1) >= 2, "worlds start again"
