"""Tianshou: one learner per agent takes turns with the others, with prey caught on the way."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
import supersuit as ss
import torch
from tianshou.algorithm import DQN, MultiAgentOffPolicyAlgorithm
from tianshou.algorithm.modelfree.dqn import DiscreteQLearningPolicy
from tianshou.algorithm.optim import AdamOptimizerFactory
from tianshou.data import Batch, Collector, ReplayBuffer, VectorReplayBuffer
from tianshou.env import DummyVectorEnv, PettingZooEnv
from tianshou.trainer import OffPolicyTrainerParams
from tianshou.utils.net.common import Net

from predprey_env import predprey_v0

pytestmark = pytest.mark.ecosystem

SMALL = {"size": 6, "max_cycles": 30, "reward": "dense"}  # random predators catch prey within an episode
AGENTS = ["predator_0", "predator_1", "predator_2", "prey_0", "prey_1"]
GAMMA = 0.9

modes = pytest.mark.parametrize("mode", ["inert", "removed"])


def world(mode: str) -> PettingZooEnv:
    env = predprey_v0.env(**SMALL, captured_prey=mode)
    return PettingZooEnv(ss.pad_action_space_v0(ss.pad_observations_v0(env)))


def learner(env: PettingZooEnv) -> DQN:
    net = Net(state_shape=env.observation_space.shape, action_shape=env.action_space.n, hidden_sizes=[32])
    policy = DiscreteQLearningPolicy(model=net, action_space=env.action_space, eps_training=1.0)
    # As all are paid after the last agent's turn, an agent's pay comes within as many turns as there are agents.
    return DQN(policy=policy, optim=AdamOptimizerFactory(), gamma=GAMMA, n_step_return_horizon=len(AGENTS))


def prepared(mode: str, seed: int = 0) -> tuple[MultiAgentOffPolicyAlgorithm, Collector]:
    """A learner for each agent, and two copies of the world that start from different seeds."""
    np.random.seed(0)  # Tianshou explores with it
    torch.manual_seed(0)
    env = world(mode)
    teams = MultiAgentOffPolicyAlgorithm(algorithms=[learner(env) for _ in env.agents], env=env)
    copies = DummyVectorEnv([lambda: world(mode)] * 2)
    copies.seed(seed)  # given to `reset` instead, one seed would be that of every copy
    collector = Collector(teams, copies, VectorReplayBuffer(10_000, 2), exploration_noise=True)
    collector.reset()
    return teams, collector


def rows(buffer: ReplayBuffer) -> Batch:
    return buffer[buffer.sample_indices(0)]  # all, in order


@cache
def turns(mode: str, seed: int = 0) -> Batch:
    """Two thousand turns of agents that play at random."""
    _, collector = prepared(mode, seed)
    collector.collect(n_step=2_000)
    return rows(collector.buffer)


@modes
def test_agents_take_turns_and_catch_prey(mode: str) -> None:
    buffer = turns(mode)
    assert buffer.obs.obs.shape == (2_000, 6)
    assert {agent: int((buffer.obs.agent_id == agent).sum()) for agent in AGENTS} == dict.fromkeys(AGENTS, 400)
    assert buffer.done.sum() > 5
    assert set(buffer.obs.agent_id[buffer.done]) == {AGENTS[-1]}
    assert (buffer.info.n_captured[buffer.done] > 0).sum() > 5


def test_time_limit_truncates_and_the_last_capture_terminates() -> None:
    buffer = turns("inert")
    ended = buffer[buffer.done]
    assert {0, 1} & set(ended.info.n_captured[ended.truncated])
    assert set(ended.info.n_captured[ended.terminated]) == {2}
    assert set(ended.info.steps[ended.truncated]) == {SMALL["max_cycles"]}


def test_an_episode_ends_at_the_first_capture_where_caught_prey_leave() -> None:
    buffer = turns("removed")
    assert (buffer.info.n_captured[~buffer.done] == 0).all()
    assert (buffer.info.n_captured[buffer.terminated] > 0).all()
    assert (buffer.info.n_captured[buffer.truncated] == 0).all()
    assert buffer.terminated.sum() > 5


@modes
def test_all_are_paid_after_the_last_agents_turn(mode: str) -> None:
    buffer = turns(mode)
    last = buffer.obs.agent_id == AGENTS[-1]
    assert not buffer.rew[~last].any()
    assert buffer.rew[last].any(axis=0).all()


def test_pay_is_the_change_of_fitness() -> None:
    buffer = turns("inert")
    for copy in (0, 1):
        rounds = buffer[(buffer.obs.agent_id == AGENTS[-1]) & (buffer.info.env_id == copy)]
        same_episode = ~rounds.done[:-1]
        # The infos are those of the agent whose turn it is next, the first predator.
        change = np.diff(rounds.info.fitness)
        np.testing.assert_allclose(rounds.rew[1:, 0][same_episode], change[same_episode], atol=1e-5)
        assert change[same_episode].max() > 5  # a capture


@modes
def test_every_agent_finds_its_own_pay_within_a_round(mode: str) -> None:
    teams, collector = prepared(mode)
    collector.collect(n_step=500)
    for values in teams.parameters():
        values.data.zero_()  # all expect nothing, so a return is what was paid on the way
    buffer, indices = collector.buffer, collector.buffer.sample_indices(0)
    batch = buffer[indices]
    paid = batch.rew[batch.obs.agent_id == AGENTS[-1]]
    learnt = teams._preprocess_batch(batch, buffer, indices)
    for i, agent in enumerate(AGENTS):
        turns_ahead = len(AGENTS) - 1 - i
        assert np.abs(paid[:, i]).sum() > 0
        np.testing.assert_allclose(learnt[agent].returns.numpy().ravel(), GAMMA**turns_ahead * paid[:, i], atol=1e-5)


def test_a_seed_gives_the_copies_different_starts_and_the_same_again() -> None:
    one, again, other = (turns.__wrapped__("inert", seed) for seed in (3, 3, 4))  # not from the cache
    first, second = (one.obs.obs[one.info.env_id == copy] for copy in (0, 1))
    assert not np.array_equal(first[:5], second[:5])
    np.testing.assert_array_equal(one.obs.obs, again.obs.obs)
    np.testing.assert_array_equal(one.rew, again.rew)
    assert not np.array_equal(one.obs.obs, other.obs.obs)


@modes
def test_every_agent_learns_with_dqn(mode: str) -> None:
    teams, collector = prepared(mode)
    before = [values.clone() for values in teams.parameters()]
    teams.run_training(
        OffPolicyTrainerParams(
            training_collector=collector,
            max_epochs=1,
            epoch_num_steps=1_000,
            collection_step_num_env_steps=1_000,
            update_step_num_gradient_steps_per_sample=0.01,
            multi_agent_return_reduction=lambda returns: returns[:, 0],
            verbose=False,
            show_progress=False,
        )
    )
    assert rows(collector.buffer).info.n_captured.max() > 0
    after = list(teams.parameters())
    assert len(after) == len(AGENTS) * 4  # weights and biases of two layers
    assert all(torch.isfinite(values).all() for values in after)
    assert not any(torch.equal(old, new) for old, new in zip(before, after, strict=True))


def test_the_readmes_snippet_collects(snippet: dict[str, Any]) -> None:
    buffer = rows(snippet["collector"].buffer)
    assert len(buffer) == 2_000
    assert buffer.info.n_captured.max() > 0
