"""sb3-contrib: policies that are told which actions count, and policies that remember."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from sb3_contrib import MaskablePPO, RecurrentPPO
from sb3_contrib.common.maskable.utils import get_action_masks, is_masking_supported
from stable_baselines3.common.vec_env import VecMonitor

from predprey_env import joint_env
from predprey_env.sb3 import SB3VecEnv

pytestmark = pytest.mark.ecosystem

SMALL = {"size": 6, "max_cycles": 30, "n_prey": 2}


def prey(num_envs: int = 2) -> SB3VecEnv:
    env = SB3VecEnv("pond", num_envs=num_envs, team="prey", opponent="surround", **SMALL)
    env.seed(0)
    return env


def test_the_masks_of_the_rows_are_those_of_their_agents() -> None:
    env = prey()
    env.reset()
    assert is_masking_supported(env)
    caught = np.zeros(4, bool)
    while not caught.any():
        env.step(np.zeros(4, int))
        caught = env._worlds._count()["captured"] == 1
    masks = get_action_masks(VecMonitor(env))
    assert masks.shape == (4, 4)
    assert masks.sum(axis=1).tolist() == [1 if each else 4 for each in caught]


def test_masked_ppo_never_chooses_what_does_not_count() -> None:
    env = prey()
    model = MaskablePPO("MlpPolicy", env, n_steps=64, batch_size=64, n_epochs=1, seed=0, device="cpu").learn(256)
    observations, idle = env.reset(), 0
    for _ in range(200):
        masks = get_action_masks(env)
        actions, _ = model.predict(observations, action_masks=masks)
        assert masks[np.arange(4), actions].all()
        idle += int((~masks.all(axis=1)).sum())
        observations, *_ = env.step(actions)
    assert idle > 0, "some prey were caught while others were not"


def test_masked_ppo_plays_a_team_as_one_agent() -> None:
    model = MaskablePPO("MlpPolicy", joint_env("prey", "surround", **SMALL), n_steps=64, seed=0, device="cpu").learn(64)
    assert all(torch.isfinite(values).all() for values in model.policy.state_dict().values())


def test_recurrent_ppo_trains_and_plays() -> None:
    env = prey()
    model = RecurrentPPO("MlpLstmPolicy", env, n_steps=32, batch_size=32, n_epochs=1, seed=0, device="cpu").learn(128)
    observations, state, starts = env.reset(), None, np.ones(4, bool)
    for _ in range(20):
        actions, state = model.predict(observations, state=state, episode_start=starts)
        observations, _, starts, _ = env.step(actions)
    assert state is not None
