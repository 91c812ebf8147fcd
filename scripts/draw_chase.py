"""Draw an episode of two saved teams: trails on the torus, brighter towards the end, and where prey were caught.

    python scripts/draw_chase.py PREDATORS PREY --seed 3 --out docs/chase.png

Without a seed: the first of a hundred in which most prey are caught.
"""

from __future__ import annotations

import argparse

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.collections import LineCollection

from esp_trainer import Team
from predprey_env import EnvConfig, PredPreyEnv
from predprey_env.rendering import PREDATOR, PREY

SEEDS = 100


def main() -> None:
    """Draw the picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("predators")
    parser.add_argument("prey")
    parser.add_argument("--seed", type=int)
    parser.add_argument("--out", default="chase.png")
    options = parser.parse_args()
    predators, prey = Team.load(options.predators), Team.load(options.prey)
    seeds = range(SEEDS) if options.seed is None else [options.seed]
    episodes = {seed: play(predators, prey, seed) for seed in seeds}
    seed = max(episodes, key=lambda seed: int(episodes[seed][1].sum()))  # of equal ones the first
    draw(*episodes[seed], world(predators), options.out)
    print(f"seed {seed}: {options.out}")


def world(team: Team) -> EnvConfig:
    """The world that a team evolved in."""
    return EnvConfig.from_dict(team.provenance["env"])


def play(predators: Team, prey: Team, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """An episode: cells ``(n_steps + 1, n_agents, 2)``, and for each agent whether it was caught."""
    env = PredPreyEnv(world(predators))
    observations, _ = env.reset(seed=seed)
    n, cells = env.config.n_agents, []
    while True:
        state = env.state()
        cells.append(np.stack([state[:n], state[n : 2 * n]], axis=1))
        if not env.agents:
            caught = np.concatenate([np.zeros(env.config.n_predators), 1 - state[2 * n : -1]])
            return np.array(cells), caught.astype(bool)
        observations, *_ = env.step(predators.act(observations) | prey.act(observations))


def draw(cells: np.ndarray, caught: np.ndarray, env: EnvConfig, out: str) -> None:
    """Save the picture of an episode."""
    mpl.rcParams["font.family"] = "sans-serif"
    figure, axes = plt.subplots(figsize=(5.2, 5.4), layout="constrained")
    for agent in range(env.n_agents):
        hunter = agent < env.n_predators
        colour = np.array(PREDATOR if hunter else PREY) / 255
        trail = cells[:, agent]
        pieces = np.stack([trail[:-1], trail[1:]], axis=1)
        near = np.abs(pieces[:, 1] - pieces[:, 0]).max(axis=1) <= 1  # a step over the edge is not a line across
        strength = np.linspace(0.12, 1.0, len(pieces))[near]
        axes.add_collection(LineCollection(pieces[near], colors=[(*colour, a) for a in strength], linewidths=1.6))
        axes.plot(*trail[0], marker="o" if hunter else "s", markersize=4, color=colour, alpha=0.35)
        axes.plot(*trail[-1], marker="o" if hunter else "s", markersize=8, color=colour, markeredgecolor="white")
        if caught[agent]:
            axes.plot(*trail[-1], marker="x", markersize=15, color="black", markeredgewidth=1.4)
    axes.set(xlim=(-1, env.size), ylim=(-1, env.size), aspect="equal", xticks=[], yticks=[])
    axes.set_title(f"{len(cells) - 1} steps: predators round, prey square, a cross where one was caught", fontsize=9)
    figure.savefig(out, dpi=140)


if __name__ == "__main__":
    main()
