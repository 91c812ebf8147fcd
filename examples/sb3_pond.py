"""Train three predators with Stable-Baselines3's PPO on the first task, until they beat every script, and film them.

Run: `pip install ".[render]" stable-baselines3`, then `python examples/sb3_pond.py`. It takes 18 CPU-seconds, prints

    the best script: 0.41 of the prey caught
    196,608 steps,  7 CPU-seconds: 0.92 of the prey caught
    393,216 steps, 13 CPU-seconds: 0.97 of the prey caught

and writes pond.zip and pond.gif.
"""

import argparse
from time import process_time

import torch
from stable_baselines3 import PPO

from esp_trainer import Arena, SB3Policy
from predprey_env import TASKS, ScriptedTeam, team_view
from predprey_env.rendering import save_video
from predprey_env.sb3 import SB3VecEnv

parser = argparse.ArgumentParser()
parser.add_argument("--quick", action="store_true", help="a torus of 8 x 8, fewer steps")
QUICK = parser.parse_args().quick
SMALL, NAME = ({"size": 8}, "pond-8x8") if QUICK else ({}, "pond")
PREY, POND = "flee_nearest", TASKS["pond"].world.replace(**SMALL)
N_ROUNDS, N_STEPS = 2, 60_000 if QUICK else 190_000

torch.set_num_threads(1)  # more threads only wait for each other: the networks are too small
arena = Arena(POND, n_episodes=400, seed=1)  # always the same starts, other than those of the training

# A row for each predator of 128 worlds, so one policy learns for all of them.
worlds = SB3VecEnv("pond", num_envs=128, team="predators", opponent=PREY, **SMALL)
rollouts = {"n_steps": 32, "gae_lambda": 0.9}  # short, as a chase is decided in few steps
updates = {"n_epochs": 4, "batch_size": 2048, "learning_rate": 5e-3, "ent_coef": 0.01}
model = PPO("MlpPolicy", worlds, **rollouts, **updates, device="cpu", seed=0)
team = SB3Policy(model, POND.team("predators"), drawn=True)  # samples its actions, as in training


def caught(predators):
    """Return the fraction of prey that predators catch."""
    return arena.meet(predators, "predators", PREY).captured.mean()


print(f"the best script: {caught(ScriptedTeam('intercept')):.2f} of the prey caught")
begun = process_time()
for _ in range(N_ROUNDS):
    model.learn(N_STEPS, reset_num_timesteps=False)
    seconds = process_time() - begun
    print(f"{model.num_timesteps:7,} steps, {seconds:2.0f} CPU-seconds: {caught(team):.2f} of the prey caught")
model.save(NAME)

env = team_view("predators", task="pond", opponent=PREY, render_mode="rgb_array", **SMALL)
observations, _ = env.reset(seed=0)
frames = [env.render()]
while env.agents:
    observations, *_ = env.step(team.act(observations))
    frames.append(env.render())
save_video(frames, f"{NAME}.gif", fps=8)
