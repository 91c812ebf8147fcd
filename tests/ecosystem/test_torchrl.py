"""TorchRL: both teams as groups, with prey caught on the way, and an iteration of independent PPO."""

from __future__ import annotations

from typing import Any

import pytest
import torch
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModule, TensorDictSequential
from torch.distributions import Categorical
from torchrl.envs import PettingZooWrapper
from torchrl.envs.utils import ExplorationType, check_env_specs, set_exploration_type
from torchrl.modules import MultiAgentMLP, ProbabilisticActor
from torchrl.objectives import ClipPPOLoss

from esp_trainer.benchmark.batched import TorchPolicy
from esp_trainer.benchmark.match import Arena
from esp_trainer.tasks import WORLDS
from esp_trainer.types import ScriptedTeams
from predprey_env import predprey_v0

pytestmark = [
    pytest.mark.ecosystem,
    pytest.mark.filterwarnings("ignore:PettingZoo in TorchRL is tested using version == 1.24.3"),
]

SMALL = {"size": 6, "max_cycles": 30, "reward": "dense"}  # random predators catch prey within an episode
TEAMS = {"predator": ["predator_0", "predator_1", "predator_2"], "prey": ["prey_0", "prey_1"]}
MASKS = {"inert": {}, "removed": {"use_mask": True, "done_on_any": False}}

modes = pytest.mark.parametrize("mode", MASKS)


def world(mode: str, seed: int = 0) -> PettingZooWrapper:
    env = predprey_v0.parallel_env(**SMALL, captured_prey=mode)
    return PettingZooWrapper(env, return_state=True, seed=seed, **MASKS[mode])


def played(env: PettingZooWrapper, policy: Any = None, steps: int = 400) -> TensorDictBase:
    torch.manual_seed(0)
    return env.rollout(steps, policy, break_when_any_done=False)


def present(rollout: TensorDictBase, team: str) -> torch.Tensor:
    """Which of a team's agents take part in a step."""
    return rollout[team].get("mask", torch.ones(rollout[team].shape, dtype=torch.bool))


@modes
def test_agents_are_grouped_by_team(mode: str) -> None:
    env = world(mode)
    assert env.group_map == TEAMS
    check_env_specs(env)
    rollout = played(env, steps=10)
    assert rollout["predator", "observation"].shape == (10, 3, 4)
    assert rollout["prey", "observation"].shape == (10, 2, 6)
    assert rollout["state"].shape == (10, 13)
    assert env.full_action_spec["predator", "action"].space.n == 5
    assert env.full_action_spec["prey", "action"].space.n == 4


@modes
def test_episodes_end_by_capture_and_by_time(mode: str) -> None:
    next_ = played(world(mode))["next"]
    captures = (next_["prey", "info", "captured"] > 0) & (next_["prey", "reward"].squeeze(-1) < 0)
    assert captures.sum() > 10
    assert next_["terminated"].sum() > 3
    assert next_["truncated"].sum() > 3
    assert torch.equal(next_["done"], next_["terminated"] | next_["truncated"])
    # The clock, the last element of the state, has run out where time did.
    assert (next_["state"][next_["truncated"].squeeze(-1), -1] == 1).all()
    # No prey is free where both are caught; the two elements before the clock say so.
    assert not next_["state"][next_["terminated"].squeeze(-1), -3:-1].any()


@modes
def test_rewards_are_the_changes_of_fitness(mode: str) -> None:
    rollout = played(world(mode))
    for team in TEAMS:
        before, after = rollout[team, "info", "fitness"], rollout["next", team, "info", "fitness"]
        paid, there = rollout["next", team, "reward"].squeeze(-1), present(rollout, team)
        torch.testing.assert_close(paid[there], (after - before)[there], atol=1e-5, rtol=0)


def test_removed_prey_are_masked_and_zero() -> None:
    rollout = played(world("removed"))
    gone = ~rollout["prey", "mask"]
    assert gone.sum() > 20
    assert not rollout["prey", "observation"][gone].any()
    assert not rollout["next", "prey", "reward"][gone].any()
    assert rollout["next", "prey", "done"][gone].all()
    assert rollout["predator", "mask"].all()


@modes
def test_the_same_seed_gives_the_same_rollout(mode: str) -> None:
    one, again, other = (played(world(mode, seed)) for seed in (3, 3, 4))
    assert (one == again).all()
    assert not torch.equal(one["state"][0], other["state"][0])


def network(env: PettingZooWrapper, team: str, n_outputs: int, out: str) -> TensorDictModule:
    """One network that the team shares."""
    n_seen = env.observation_spec[team, "observation"].shape[-1]
    net = MultiAgentMLP(
        n_seen, n_outputs, len(TEAMS[team]), centralized=False, share_params=True, depth=1, num_cells=32
    )
    return TensorDictModule(net, [(team, "observation")], [(team, out)])


def actor(env: PettingZooWrapper, team: str) -> ProbabilisticActor:
    return ProbabilisticActor(
        network(env, team, env.full_action_spec[team, "action"].space.n, "logits"),
        in_keys=[(team, "logits")],
        out_keys=[(team, "action")],
        distribution_class=Categorical,
        return_log_prob=True,
        log_prob_key=(team, "log_prob"),
    )


@modes
def test_each_team_learns_with_ppo(mode: str) -> None:
    env = world(mode)
    torch.manual_seed(0)
    losses = {
        team: ClipPPOLoss(actor(env, team), network(env, team, 1, "state_value"), reduction="none") for team in TEAMS
    }
    keys = ("action", "reward", "done", "terminated", "advantage", "value_target")
    for team, loss in losses.items():
        loss.set_keys(value=(team, "state_value"), sample_log_prob=(team, "log_prob"), **{k: (team, k) for k in keys})
    with torch.no_grad(), set_exploration_type(ExplorationType.RANDOM):
        rollout = played(env, TensorDictSequential(*(loss.actor_network for loss in losses.values())))
    assert rollout["next", "predator", "info", "n_captured"].max() == 2

    for team, loss in losses.items():
        before = [values.clone() for values in loss.parameters()]
        terms = loss(rollout)
        total = terms["loss_objective"] + terms["loss_critic"] + terms["loss_entropy"]
        total[present(rollout, team)].mean().backward()
        torch.optim.Adam(loss.parameters(), 1e-3).step()
        after = list(loss.parameters())
        assert all(torch.isfinite(values).all() for values in after)
        assert not any(torch.equal(old, new) for old, new in zip(before, after, strict=True))


def test_the_readmes_snippet_rolls_out(snippet: dict[str, Any]) -> None:
    rollout = snippet["rollout"]
    assert rollout.shape == (500,)
    assert rollout["state"].shape == (500, 13)
    assert rollout["next", "predator", "info", "n_captured"].max() > 0


def test_an_actor_is_a_candidate_of_the_benchmark() -> None:
    """As ``torch:MODULE:FUNCTION:FILE`` loads it: what it writes as its action is played."""
    shape = WORLDS["3v2"].team("prey")
    torch.manual_seed(0)
    network = TensorDictModule(torch.nn.Linear(shape.n_seen, shape.n_actions), ["observation"], ["logits"])
    actor = ProbabilisticActor(network, in_keys=["logits"], distribution_class=Categorical)
    seen = torch.randn(50, 2, shape.n_seen)
    likely = TorchPolicy(actor, shape).act_batch(seen.numpy())
    assert likely.tolist() == network.module(seen).argmax(-1).tolist()
    drawn = TorchPolicy(actor, shape, drawn=True)

    def draw(seed: int) -> list[list[int]]:
        drawn.reset(seed)
        return drawn.act_batch(seen.numpy()).tolist()

    assert draw(1) == draw(1)
    assert draw(1) != draw(2)
    met = Arena(WORLDS["3v2"], 8, 0).meet(TorchPolicy(actor, shape), "prey", ScriptedTeams("random"))
    assert (met.steps > 0).all()
