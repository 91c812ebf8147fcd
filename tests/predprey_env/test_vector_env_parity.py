"""The batched environment against the single one: the same episodes, to the bit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from hypothesis import given
from hypothesis import strategies as st

from predprey_env import EnvConfig, PredPreyEnv, PredPreyVectorEnv, TeamView
from predprey_env.agents import other_team
from predprey_env.config import TEAMS, TeamName
from predprey_env.policies import SCRIPTS, Policy, ScriptedTeam

CONFIGS = st.from_type(EnvConfig).map(lambda config: config.replace(captured_prey="inert"))


class ByHand:
    """A policy that the vector env knows nothing of: its opponents' script, asked in Python."""

    def __init__(self, policy: Policy) -> None:
        self.reset, self.act = policy.reset, policy.act


def opponent(config: EnvConfig, team: TeamName, script: str, *, by_hand: bool) -> Policy:
    policy = ScriptedTeam.of(script, other_team(team), config)
    return ByHand(policy) if by_hand else policy


def same(a: Any, b: Any) -> bool:
    return np.asarray(a).tobytes() == np.asarray(b).tobytes()


def compare(config: EnvConfig, team: TeamName, script: str, n_worlds: int, n_steps: int, seed: int, **how: bool) -> int:
    """Play both side by side with random actions; returns how many episodes ended."""
    player = opponent(config, team, script, **how)
    many = PredPreyVectorEnv(config, n_worlds, team, player, AutoresetMode.SAME_STEP)
    singles = [
        TeamView(PredPreyEnv(config), team, opponent(config, team, script, by_hand=False)) for _ in range(n_worlds)
    ]
    n_agents, ended = config.team(team).n_agents, 0
    views, infos = many.reset(seed=seed)
    for world, single in enumerate(singles):
        seen, told = single.reset(seed=seed + world)
        compare_rows(views, infos, seen, told, world * n_agents)
    actions = np.random.default_rng(seed)
    for _ in range(n_steps):
        chosen = actions.integers(0, config.team(team).n_actions, many.num_envs)
        views, rewards, terminated, truncated, infos = many.step(chosen)
        for world, single in enumerate(singles):
            rows = slice(world * n_agents, (world + 1) * n_agents)
            results = single.step(dict(zip(single.agents, chosen[rows].tolist(), strict=True)))
            seen, *_, told = results
            for array, values in zip((rewards, terminated, truncated), results[1:4], strict=True):
                assert same(array[rows], np.array(list(values.values()), array.dtype))
            if not single.agents:
                ended += 1
                assert infos["_final_obs"][rows].all()
                compare_rows(infos["final_obs"], infos["final_info"], seen, told, world * n_agents)
                seen, told = single.reset()
            compare_rows(views, infos, seen, told, world * n_agents)
    return ended


def compare_rows(views: np.ndarray, infos: Any, seen: Any, told: Any, first: int) -> None:
    for i, agent in enumerate(seen):
        assert same(views[first + i], seen[agent])
        assert infos["captured"][first + i] == told[agent]["captured"]
        assert infos["n_captured"][first + i] == told[agent]["n_captured"]
        assert infos["steps"][first + i] == told[agent]["steps"]


@given(config=CONFIGS, team=st.sampled_from(TEAMS), seed=st.integers(0, 2**31), data=st.data())
def test_worlds_in_a_batch_are_single_worlds(config: EnvConfig, team: TeamName, seed: int, data: st.DataObject) -> None:
    script = data.draw(st.sampled_from(SCRIPTS[other_team(team)]))
    compare(config, team, script, n_worlds=data.draw(st.integers(1, 19)), n_steps=25, seed=seed, by_hand=False)


@pytest.mark.parametrize("move_order", ["simultaneous", "prey_first"])
@pytest.mark.parametrize("reward", ["terminal", "dense"])
@pytest.mark.parametrize(("team", "script"), [(t, script) for t in TEAMS for script in SCRIPTS[other_team(t)]])
def test_thousands_of_episodes_agree(team: TeamName, script: str, reward: str, move_order: str) -> None:
    config = EnvConfig(size=7, max_cycles=12, reward=reward, move_order=move_order)
    assert compare(config, team, script, n_worlds=21, n_steps=60, seed=5, by_hand=False) > 100


@pytest.mark.parametrize("move_order", ["simultaneous", "prey_first"])
@pytest.mark.parametrize(("team", "script"), [("predators", "random"), ("prey", "intercept")])
def test_an_opponent_outside_plays_as_one_inside(team: TeamName, script: str, move_order: str) -> None:
    config = EnvConfig(size=7, max_cycles=12, reward="dense", move_order=move_order)
    assert compare(config, team, script, n_worlds=18, n_steps=40, seed=5, by_hand=True) > 50
