"""Where episodes start, and what of it decides them: parity.

On an even torus every step changes the Manhattan distance between a predator and a prey that both move by an even
number, so a predator at an odd distance never lands on the prey unless it idles once. Whoever compares teams must know
how many predators started at an even distance.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from esp_trainer.evaluation.kernel import seed_of
from predprey_env.config import EnvConfig
from predprey_env.starts import draw_starts, on_a_predator

_PATIENCE = 100  # draws before a start is given up


class CellStarts:
    """Starts of the predator-prey world: the cells of all agents, int32 ``(n_trials, n_episodes, n_agents, 2)``."""

    def __init__(self, config: EnvConfig) -> None:
        self.config = config

    def draw(self, generator: np.random.Generator, n_trials: int, n_episodes: int) -> np.ndarray:
        """Uniform random starts."""
        starts = draw_starts(generator, n_trials * n_episodes, self.config)
        return starts.reshape(n_trials, n_episodes, self.config.n_agents, 2)

    def held_out(self, generator: np.random.Generator, n_trials: int) -> np.ndarray:
        """Random starts, one a trial, that hold the parities in their true proportions: exactly, for multiples of 8.

        On an even torus the agents' parities relative to the first prey run through all patterns in turn: with three
        predators, 0, 1, 2 and 3 of them are at an even distance from a prey in 1 : 3 : 3 : 1. On an odd torus going
        round changes a parity, and the starts are plain random ones.
        """
        config = self.config
        starts = draw_starts(generator, n_trials, config)
        if config.size % 2:
            return starts[:, None]
        odd = np.arange(n_trials)[:, None] >> np.arange(config.n_agents - 1) & 1
        odd = np.insert(odd, config.n_predators, 0, axis=1)
        starts = _with_parities(starts, odd, config)
        if config.start_collisions == "redraw":
            _part(generator, starts, odd, config)
        return starts[:, None]

    def even_predators(self, starts: np.ndarray) -> np.ndarray:
        """For each prey, how many predators start at an even distance: int ``(..., n_prey)``."""
        return np.asarray((distances(starts, self.config) % 2 == 0).sum(axis=-2))

    def reset_arguments(self, start: np.ndarray) -> dict[str, Any]:
        """What to call the environment's ``reset`` with for a start."""
        return {"options": {"starts": start}}

    def policy_seed(self, start: np.ndarray) -> int:
        """What both teams are reset with in an episode from a start."""
        return int(seed_of(start))


class SeedStarts:
    """Starts of any environment: the seeds to reset it with, int64 ``(n_trials, n_episodes)``."""

    def __init__(self, n_prey: int) -> None:
        self.n_prey = n_prey

    def draw(self, generator: np.random.Generator, n_trials: int, n_episodes: int) -> np.ndarray:
        """Random seeds."""
        return generator.integers(0, 2**31, (n_trials, n_episodes))

    def held_out(self, generator: np.random.Generator, n_trials: int) -> np.ndarray:
        """Random seeds, one a trial."""
        return self.draw(generator, n_trials, 1)

    def even_predators(self, starts: np.ndarray) -> np.ndarray:
        """Nothing is known of parity: all 0."""
        return np.zeros((*starts.shape, self.n_prey), int)

    def reset_arguments(self, start: np.ndarray) -> dict[str, Any]:
        """What to call the environment's ``reset`` with for a start."""
        return {"seed": int(start)}

    def policy_seed(self, start: np.ndarray) -> int:
        """What both teams are reset with in an episode from a start."""
        return int(start)


def distances(starts: np.ndarray, config: EnvConfig) -> np.ndarray:
    """Toroidal Manhattan distances, int ``(..., n_predators, n_prey)``, of starts ``(..., n_agents, 2)``."""
    predators, prey = starts[..., : config.n_predators, None, :], starts[..., None, config.n_predators :, :]
    apart = np.abs(predators - prey)
    return np.asarray(np.minimum(apart, config.size - apart).sum(axis=-1))


def _part(generator: np.random.Generator, starts: np.ndarray, odd: np.ndarray, config: EnvConfig) -> None:
    """Redraw prey that start in a predator's cell, in place; all agents, if predators fill every cell of a parity."""
    tries = 0
    while (met := on_a_predator(starts, config)).any():
        tries += 1
        again = met.any(axis=1)
        fresh = starts[again]
        if tries % _PATIENCE:
            prey = fresh[:, config.n_predators :]
            cells = generator.integers(0, config.size, prey.shape, dtype=prey.dtype)
            cells[..., 0] ^= (cells.sum(axis=-1) + prey.sum(axis=-1)) & 1  # the parity that it had
            prey[met[again]] = cells[met[again]]
        else:
            fresh = _with_parities(draw_starts(generator, len(fresh), config), odd[again], config)
        starts[again] = fresh


def _with_parities(starts: np.ndarray, odd: np.ndarray, config: EnvConfig) -> np.ndarray:
    """Starts in which the agents marked ``odd`` are at an odd distance from the first prey, and the others are not.

    Those that must move go to the other cell of a pair of neighbours, so that the cells stay uniform.
    """
    parity = starts.sum(axis=-1) + starts[:, config.n_predators].sum(axis=-1, keepdims=True)
    placed = starts.copy()
    placed[..., 0] ^= ((parity + odd) & 1).astype(placed.dtype)
    return placed
