"""Train three predators with AgileRL's PPO, until they catch a prey that runs from the nearest of them.

Run: `pip install agilerl peft`, then `python examples/train_agilerl.py`. It takes 26 CPU-seconds and prints, between
the library's own lines,

          0 steps,  0 CPU-seconds: 0.00 of the prey caught
    270,336 steps,  9 CPU-seconds: 0.99 of the prey caught
    540,672 steps, 16 CPU-seconds: 0.99 of the prey caught
"""

import argparse
from time import process_time

import torch
from agilerl.algorithms import PPO
from agilerl.training.train_on_policy import train_on_policy

from esp_trainer import Arena, BatchedPolicy
from predprey_env import EnvConfig, vector_env

parser = argparse.ArgumentParser()
parser.add_argument("--quick", action="store_true", help="a smaller torus, fewer steps")
QUICK = parser.parse_args().quick
PREY, CONFIG = "flee_nearest", EnvConfig(n_prey=1, size=8 if QUICK else 20, reward="dense")
N_ROUNDS, N_STEPS = 2, 50_000 if QUICK else 250_000

torch.set_num_threads(1)  # on a busy machine two threads took 8 times the CPU time of one: networks are too small
torch.manual_seed(0)
arena = Arena(CONFIG, n_episodes=200, seed=1)  # always the same starts, other than those of the training


class Predators(BatchedPolicy):
    """The agent as a team: an action for each row of observations."""

    def choose(self, rows):
        return agent.get_action(rows)[0]  # sampled, as in training


def report():
    """Print the fraction of prey that the predators catch."""
    caught, seconds = arena.meet(Predators(), "predators", PREY).captured.mean(), process_time() - begun
    print(f"{agent.steps:9,} steps, {seconds:2.0f} CPU-seconds: {caught:.2f} of the prey caught")


# A row for each predator, so one agent learns for all of them. "SameStep": AgileRL expects no steps without effect.
worlds = vector_env(128, "predators", opponent=PREY, autoreset_mode="SameStep", **CONFIG.model_dump())
spaces = worlds.single_observation_space, worlds.single_action_space
n_rows = worlds.num_envs  # AgileRL counts every row's step; it learns after 64 steps of the worlds
agent = PPO(*spaces, num_envs=n_rows, learn_step=64 * n_rows, batch_size=4096, lr=1e-3)
begun = process_time()
report()
for done in range(N_ROUNDS):
    limits = {"max_steps": (done + 1) * N_STEPS, "evo_steps": N_STEPS, "eval_loop": 1}
    (agent,), _ = train_on_policy(worlds, "predprey", "PPO", [agent], **limits, verbose=False)
    report()
