"""Play a team of the zoo against another: one episode step by step, then a thousand in compiled code.

Run: `python examples/play_zoo_team.py`. It takes 1 CPU-second, and 19 more the first time, to compile. It prints

    one episode: the prey is caught after 147 steps; the predators' fitness is 25.0
    1000 episodes: 0.825 [0.800, 0.847] of the prey caught, 97 steps an episode
"""

import argparse

from esp_trainer import WORLDS, load_team, match
from predprey_env import parallel_env

PREDATORS = "drawn-3v1/predators/seed-502-middle"  # `esp-trainer teams` lists them all, with ratings
PREY = "modern-3v1/prey/seed-500-late"

parser = argparse.ArgumentParser()
parser.add_argument("--quick", action="store_true", help="fewer episodes")
n_episodes = 64 if parser.parse_args().quick else 1000

predators, prey = load_team(PREDATORS), load_team(PREY)

# An evolved team is a policy: reset(seed), and act(observations) -> actions.
env = parallel_env(n_prey=1)
observations, infos = env.reset(seed=1)
predators.reset(seed=1)  # these predators sample their actions; the seed decides which
prey.reset(seed=1)
while env.agents:
    actions = predators.act(observations) | prey.act(observations)
    observations, rewards, terminations, truncations, infos = env.step(actions)
end = "caught" if any(terminations.values()) else "free"
steps, fitness = infos["prey_0"]["steps"], rewards["predator_0"]
print(f"one episode: the prey is {end} after {steps:.0f} steps; the predators' fitness is {fitness}")

# Many episodes, from starts in which odd and even distances have their true proportions.
found = match(predators, prey, WORLDS["3v1"], n_episodes, seed=0)
print(f"{n_episodes} episodes: {found.caught} of the prey caught, {found.steps:.0f} steps an episode")
