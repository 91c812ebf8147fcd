"""SuperSuit: padding, black death, stacked frames and copies in processes, with prey caught on the way."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import supersuit as ss
from gymnasium.vector import VectorEnv
from pettingzoo import ParallelEnv

from predprey_env import predprey_v0

pytestmark = pytest.mark.ecosystem

SMALL = {"size": 6, "max_cycles": 30}  # so small that random predators catch prey within an episode
PREDATORS, PREY = ["predator_0", "predator_1", "predator_2"], ["prey_0", "prey_1"]
AGENTS = PREDATORS + PREY
MODES = ["inert", "removed"]

Step = tuple[dict[str, Any], ...]


def padded(**options: Any) -> ParallelEnv[str, np.ndarray, int]:
    return ss.pad_action_space_v0(ss.pad_observations_v0(predprey_v0.parallel_env(**SMALL, **options)))


def wrapped(mode: str, **options: Any) -> ParallelEnv[str, np.ndarray, int]:
    env = padded(captured_prey=mode, **options)
    return ss.black_death_v3(env) if mode == "removed" else env


def side_by_side(one: Any, other: Any, episodes: int) -> Iterator[tuple[Step, Step]]:
    """Play two environments from the same seeds with the same actions, until the second has ended; prey's fifth action,
    which the second lacks, is its first.
    """
    generator = np.random.default_rng(0)
    for seed in range(episodes):
        one.reset(seed=seed)
        other.reset(seed=seed)
        while other.agents:
            actions = {agent: int(generator.integers(5)) for agent in AGENTS}
            known = {agent: 0 if agent in PREY and action == 4 else action for agent, action in actions.items()}
            yield (
                one.step({agent: actions[agent] for agent in one.agents}),
                other.step({agent: known[agent] for agent in other.agents}),
            )


def n_captured(infos: dict[str, Any]) -> int:
    return max(info["n_captured"] for info in infos.values())


@pytest.mark.parametrize("mode", MODES)
def test_padding_adds_zeros_and_changes_nothing_else(mode: str) -> None:
    env = padded(captured_prey=mode, reward="dense")
    plain = predprey_v0.parallel_env(**SMALL, captured_prey=mode, reward="dense")
    assert {env.observation_space(agent).shape for agent in AGENTS} == {(6,)}
    assert {env.action_space(agent).n for agent in AGENTS} == {5}
    steps = captures = 0
    for (observations, *rest), (plain_observations, *plain_rest) in side_by_side(env, plain, episodes=20):
        assert rest == plain_rest
        assert observations.keys() == plain_observations.keys()
        for agent, seen in plain_observations.items():
            np.testing.assert_array_equal(observations[agent], np.pad(seen, (0, 6 - len(seen))))
        steps += 1
        captures += not plain.agents and n_captured(plain_rest[-1])
    assert steps > 300
    assert captures > 20


def test_black_death_keeps_caught_prey_as_zeros_and_adds_nothing_to_their_return() -> None:
    env = ss.black_death_v3(padded(captured_prey="removed", reward="dense"))
    plain = predprey_v0.parallel_env(**SMALL, captured_prey="removed", reward="dense")
    dead_steps = 0
    for (observations, rewards, *_, infos), (plain_observations, plain_rewards, *_) in side_by_side(env, plain, 20):
        assert list(env.agents) == AGENTS
        assert observations.keys() == rewards.keys() == infos.keys() == set(AGENTS)
        for agent in AGENTS:
            if agent in plain_observations:
                assert rewards[agent] == plain_rewards[agent]
            else:
                dead_steps += 1
                assert not observations[agent].any()
                assert rewards[agent] == 0
    assert dead_steps > 50


def test_black_death_ends_an_episode_one_step_after_the_world() -> None:
    env = ss.black_death_v3(padded(captured_prey="removed"))
    env.reset(seed=0)
    for _ in range(SMALL["max_cycles"]):
        _, rewards, ended, _, infos = env.step(dict.fromkeys(AGENTS, 0))  # all go east, so nobody meets
        assert not any(ended.values())
    assert rewards == {agent: info["fitness"] for agent, info in infos.items()}
    observations, rewards, ended, _, _ = env.step(dict.fromkeys(AGENTS, 0))
    assert all(ended.values())
    assert not any(rewards.values())
    assert not any(seen.any() for seen in observations.values())


@pytest.mark.parametrize("mode", MODES)
def test_stacked_frames_are_the_last_observations(mode: str) -> None:
    env, plain = ss.frame_stack_v2(wrapped(mode), 3), wrapped(mode)
    assert env.observation_space("prey_1").shape == (18,)
    history = {agent: [seen] * 3 for agent, seen in plain.reset(seed=0)[0].items()}
    for agent, stack in env.reset(seed=0)[0].items():
        np.testing.assert_array_equal(stack, np.concatenate(history[agent]))
    for (observations, *_), (plain_observations, *_) in side_by_side(env, plain, episodes=1):
        for agent, seen in plain_observations.items():
            history[agent] = [*history[agent][1:], seen]
            np.testing.assert_array_equal(observations[agent], np.concatenate(history[agent]))


def vectorised(mode: str, copies: int, processes: int, **options: Any) -> VectorEnv:
    env = ss.pettingzoo_env_to_vec_env_v1(ss.frame_stack_v2(wrapped(mode, **options), 2))
    return ss.concat_vec_envs_v1(env, copies, num_cpus=processes)


def played(env: VectorEnv, steps: int, seed: int | None = 0) -> list[tuple[Any, ...]]:
    """The starts and what every step returned, of random play."""
    generator = np.random.default_rng(0)
    starts, _ = env.reset(seed=seed)
    return [(starts,), *(env.step(generator.integers(5, size=env.num_envs)) for _ in range(steps))]


@pytest.mark.parametrize("processes", [1, 2])
@pytest.mark.parametrize("mode", MODES)
def test_copies_play_on_through_captures_and_ends(mode: str, processes: int) -> None:
    env = vectorised(mode, 2, processes)
    assert env.num_envs == 2 * len(AGENTS)
    _, *steps = played(env, 300)
    env.close()
    infos = [info for *_, infos in steps for info in infos]
    assert sum(info.get("captured", 0) for info in infos) > 20
    # Copies start anew by themselves, their infos taking the place of the last; black death adds a step that has none.
    assert {info["steps"] for info in infos if info} == set(range(SMALL["max_cycles"] + (mode == "removed")))
    rewards = np.concatenate([rewards for _, rewards, *_ in steps]).reshape(-1, len(AGENTS))
    assert rewards[:, 0].max() == 25  # both prey caught
    assert rewards[:, 0].min() == 0
    assert (rewards[:, 3:] == 25).any()  # none caught


@pytest.mark.parametrize("mode", MODES)
def test_two_processes_play_as_one_does(mode: str) -> None:
    both = []
    for processes in (1, 2):
        env = vectorised(mode, 2, processes, reward="dense")
        both.append(played(env, 200))
        env.close()
    np.testing.assert_equal(both[0], both[1])


@pytest.mark.parametrize("processes", [1, 2])
def test_a_seed_gives_the_copies_different_starts_and_the_same_again(processes: int) -> None:
    env = vectorised("inert", 2, processes)
    first, again, other = (played(env, 100, seed) for seed in (7, 7, 8))
    env.close()
    assert not np.array_equal(first[0][0][: len(AGENTS)], first[0][0][len(AGENTS) :])
    assert not np.array_equal(first[0][0], other[0][0])
    np.testing.assert_equal(first, again)


@pytest.mark.parametrize("processes", [1, 2])
def test_copies_start_differently_without_a_seed_too(processes: int) -> None:
    env = vectorised("inert", 4, processes)
    starts, _ = env.reset()
    env.close()
    assert len(np.unique(starts.reshape(4, -1), axis=0)) == 4


def test_processes_that_hold_two_copies_each_share_seeds() -> None:
    """SuperSuit numbers seeds from the process's place, not the copy's: docs/tools.md gives each copy a process."""
    env = vectorised("inert", 4, processes=2)
    starts, _ = env.reset(seed=0)
    env.close()
    copies = starts.reshape(4, -1)
    np.testing.assert_array_equal(copies[1], copies[2])
    assert len(np.unique(copies, axis=0)) == 3


def test_the_readmes_snippet_vectorises(snippet: dict[str, Any]) -> None:
    env = snippet["env"]
    assert env.num_envs == 2 * len(AGENTS)
    assert snippet["observations"].shape == (10, 18)
    assert snippet["rewards"].shape == (10,)
    _, *steps = played(env, 300)
    env.close()
    assert sum(info.get("captured", 0) for *_, infos in steps for info in infos) > 0
