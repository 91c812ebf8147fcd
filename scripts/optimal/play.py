"""What optimal play looks like: two optimal teams against each other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from esp_trainer.exact.solution import by_parity, solve
from esp_trainer.exact.team import OptimalTeam
from predprey_env import predprey_v0
from predprey_env.config import EnvConfig

IDLE = 4


class Habits(NamedTuple):
    """By time step, means over episodes that are still going on."""

    size: int
    steps: int
    n_episodes: int
    value: float
    caught: float
    """Share of prey caught; its standard error is ``(value (1 - value) / n_episodes) ** 0.5``."""
    going: np.ndarray
    """How many episodes were still going on."""
    idling: np.ndarray
    """Share of predators that stand still."""
    even: np.ndarray
    """Share of predators at an even distance from the prey."""
    distance: np.ndarray
    """Mean distance of a predator to the prey, in steps."""
    sides: np.ndarray
    """Of the four quarters around the prey, how many have a predator."""
    exits: np.ndarray
    """Actions of the prey that it takes with a chance of at least a hundredth."""


def watch(size: int, n_episodes: int) -> Habits:
    """Episodes from random starts, one and a half times the size long."""
    config = EnvConfig(size=size, n_prey=1, max_cycles=size * 3 // 2)
    solution = solve(config, config.max_cycles)
    predators, prey = OptimalTeam("predators", solution), OptimalTeam("prey", solution)
    env = predprey_v0.parallel_env(**config.model_dump())
    sums, counts, caught = np.zeros((5, config.max_cycles)), np.zeros(config.max_cycles), 0
    for seed in range(n_episodes):
        observations, _ = env.reset(seed=seed)
        predators.reset(seed)
        prey.reset(seed)
        terminations: dict[str, bool] = {}
        for step in range(config.max_cycles):
            offsets = np.stack([observations[f"predator_{i}"] for i in range(config.n_predators)]).astype(int)
            exits = (
                (prey.strategies(prey.cells({"prey_0": observations["prey_0"]}), config.max_cycles - step)[1]) >= 0.01
            )
            hunting, fleeing = predators.act(observations), prey.act(observations)
            far = np.abs(offsets).sum(axis=1)
            idle = np.mean([action == IDLE for action in hunting.values()])
            sums[:, step] += idle, np.mean(far % 2 == 0), far.mean(), _quarters(offsets), exits.sum()
            counts[step] += 1
            observations, _, terminations, _, _ = env.step({**hunting, **fleeing})
            if not env.agents:
                break
        caught += terminations["prey_0"]
    seen = counts > 0
    value = by_parity(solution, config.max_cycles)[0]
    means = sums[:, seen] / counts[seen]
    return Habits(size, config.max_cycles, n_episodes, value, caught / n_episodes, counts[seen].astype(int), *means)


def _quarters(offsets: np.ndarray) -> int:
    """How many of the quarters east, north, west and south of the prey have a predator."""
    angles = np.arctan2(-offsets[:, 1], -offsets[:, 0])
    return len(set((np.round(angles / (np.pi / 2)) % 4).astype(int).tolist()))
