"""A team as one agent, by itself and from Gymnasium's registry."""

from __future__ import annotations

import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from predprey_env import JointTeam, PredPreyVectorEnv, joint_env, team_view

WORLD: dict[str, Any] = {"size": 6, "max_cycles": 12, "n_prey": 2}
TEAM = pytest.mark.parametrize("team", ["predators", "prey"])


@TEAM
@pytest.mark.parametrize("order", ["simultaneous", "prey_first"])
@pytest.mark.parametrize("credit", ["team", "individual"])
def test_it_plays_as_the_team_view(team: Any, order: str, credit: str) -> None:
    options: dict[str, Any] = {**WORLD, "move_order": order, "credit": credit, "reward": "dense"}
    joint, view = (make(team, ["random", "random"], **options) for make in (joint_env, team_view))
    seen, told = joint.reset(seed=3)
    observations, infos = view.reset(seed=3)
    agents, generator, caught = view.possible_agents, np.random.default_rng(0), 0
    for _ in range(100):
        assert (seen == np.concatenate([observations[agent] for agent in agents])).all()
        assert seen in joint.observation_space
        assert told == {name: infos[agents[0]][name] for name in ("n_captured", "steps", "opponent")}
        actions = generator.integers(0, joint.action_space.nvec)
        seen, reward, terminated, truncated, told = joint.step(actions)
        observations, rewards, terminations, truncations, infos = view.step(dict(zip(agents, actions, strict=True)))
        assert reward == np.mean(list(rewards.values()))
        assert (terminated, truncated) == (any(terminations.values()), any(truncations.values()))
        caught += told["n_captured"]
        if terminated or truncated:
            (seen, told), (observations, infos) = joint.reset(), view.reset()
    assert caught


@TEAM
def test_gymnasium_makes_it_and_finds_nothing_wrong(team: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make(f"predprey_env:predprey/{team.title()}-v0", **WORLD)
        check_env(env.unwrapped, skip_render_check=True)
        env.reset(seed=0)
        env.step(env.action_space.sample())
    assert isinstance(env.unwrapped, JointTeam)
    assert env.unwrapped.view.team == team
    assert env.unwrapped.size == 6


@TEAM
def test_gymnasium_makes_many_worlds(team: str) -> None:
    envs = gymnasium.make_vec(
        f"predprey/{team.title()}-v0", num_envs=8, vectorization_mode="vector_entry_point", opponent="random", **WORLD
    )
    assert isinstance(envs.unwrapped, PredPreyVectorEnv)
    assert (envs.unwrapped.n_worlds, envs.unwrapped.team) == (8, team)
    assert envs.reset(seed=0)[0].shape[0] == envs.num_envs == 8 * (3 if team == "predators" else 2)


@pytest.mark.parametrize("actions", [[0, 0], [0.0, 0.0, 0.0], np.zeros((3, 1), int)])
def test_actions_for_others_are_refused(actions: Any) -> None:
    env = joint_env("predators", "random", **WORLD)
    with pytest.raises(RuntimeError, match=r"^reset\(\) must be called before step\(\)$"):
        env.step(np.zeros(3, int))
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"^actions must be integers of shape \(3,\), got (int|float)64 of shape"):
        env.step(actions)
    with pytest.raises(ValueError, match=r"^actions must be integers of shape \(3,\), got rows of unequal length$"):
        env.step([0, [1, 2], 3])  # type: ignore[arg-type]


def test_prey_that_leave_are_refused() -> None:
    with pytest.raises(
        ValueError,
        match=r"^in a joint env captured_prey must be 'inert', as the team is one agent, got 'removed'$",
    ):
        joint_env("prey", "random", captured_prey="removed")


def test_pictures_and_attributes_are_those_of_the_world() -> None:
    env = joint_env("predators", "random", render_mode="ansi", **WORLD)
    env.reset(seed=0)
    assert env.render().startswith("step 0/12")
    assert (env.max_cycles, env.config.n_prey, env.metadata["name"]) == (12, 2, "predprey_joint_v0")
    env.max_cycles = 20
    assert env.view.env.max_cycles == 20
    env.close()


def test_the_opponent_is_replaced_as_in_the_team_view() -> None:
    joint, view = joint_env("prey", "random", **WORLD), team_view("prey", "random", **WORLD)
    ends = []
    for env in (joint, view):
        env.reset(seed=3)
        env.set_opponent("surround")
        ends.append(env.reset(seed=4)[0])
    seen, observations = ends
    still = dict.fromkeys(view.possible_agents, 0)
    for _ in range(5):
        seen, observations = joint.step([0, 0])[0], view.step(still)[0]
        assert (seen == np.concatenate([observations[prey] for prey in still])).all()
    assert joint.opponent is joint.view.opponent
    with pytest.raises(AttributeError, match=r"opponent is read-only; call set_opponent\(opponent\)"):
        joint.opponent = "random"
