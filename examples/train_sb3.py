"""Train three predators with Stable-Baselines3's PPO, until they catch a prey that runs from the nearest of them.

Run: `pip install stable-baselines3`, then `python examples/train_sb3.py`. It takes 31 CPU-seconds and prints

          0 steps,  1 CPU-seconds: 0.00 of the prey caught
    270,336 steps, 11 CPU-seconds: 0.92 of the prey caught
    540,672 steps, 21 CPU-seconds: 0.97 of the prey caught
    811,008 steps, 31 CPU-seconds: 1.00 of the prey caught
"""

import argparse
from time import process_time

import torch
from stable_baselines3 import PPO

from esp_trainer import Arena, SB3Policy
from predprey_env import EnvConfig, vector_env
from predprey_env.sb3 import SB3VecEnv

parser = argparse.ArgumentParser()
parser.add_argument("--quick", action="store_true", help="a smaller torus, fewer steps")
QUICK = parser.parse_args().quick
PREY, CONFIG = "flee_nearest", EnvConfig(n_prey=1, size=8 if QUICK else 20, reward="dense")
N_ROUNDS, N_STEPS = 3, 50_000 if QUICK else 250_000

torch.set_num_threads(1)  # on a busy machine two threads took 8 times the CPU time of one: networks are too small
arena = Arena(CONFIG, n_episodes=200, seed=1)  # always the same starts, other than those of the training


def report():
    """Print the fraction of prey that the predators catch, with actions sampled as in training."""
    team = SB3Policy(model, CONFIG.team("predators"), drawn=True)
    caught, seconds = arena.meet(team, "predators", PREY).captured.mean(), process_time() - begun
    print(f"{model.num_timesteps:9,} steps, {seconds:2.0f} CPU-seconds: {caught:.2f} of the prey caught")


# A row for each predator, so one policy learns for all of them; with reward="dense" every step nearer pays.
worlds = SB3VecEnv(vector_env(128, "predators", opponent=PREY, **CONFIG.model_dump()))
settings = {"n_steps": 64, "batch_size": 4096, "n_epochs": 5, "learning_rate": 1e-3}
model = PPO("MlpPolicy", worlds, **settings, device="cpu", seed=0)
begun = process_time()
report()
for _ in range(N_ROUNDS):
    model.learn(N_STEPS, reset_num_timesteps=False)
    report()
