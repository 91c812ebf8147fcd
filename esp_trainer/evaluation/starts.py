"""Starts of episodes, and the parities that decide many of them.

On an even torus, a step in which a predator and a prey both move changes the Manhattan distance between them by an even
number. So a predator at an odd distance never lands on the prey unless it idles. A comparison of teams must therefore
count the predators that start at an even distance.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from esp_trainer.arrays import Counts, EpisodeStarts
from esp_trainer.evaluation.kernel import seed_of
from predprey_env.arrays import Starts
from predprey_env.config import EnvConfig
from predprey_env.rules.starts import draw_starts, on_a_predator

_PATIENCE = 100  # attempts to move prey before all agents of a start are sampled again


class CellStarts:
    """Starts of the predator-prey world: the cells of all agents, int32 ``(n_trials, n_episodes, n_agents, 2)``."""

    def __init__(self, config: EnvConfig) -> None:
        self.config = config

    def draw(self, generator: np.random.Generator, n_trials: int, n_episodes: int) -> Starts:
        """Sample uniform starts."""
        starts = draw_starts(generator, n_trials * n_episodes, self.config)
        return starts.reshape(n_trials, n_episodes, self.config.n_agents, 2)

    def held_out(self, generator: np.random.Generator, n_trials: int) -> Starts:
        """Sample starts, one per trial, with the parities in their true proportions: exactly, for multiples of 8.

        On an even torus the agents' parities relative to the first prey run through all patterns in turn. With three
        predators, 0, 1, 2 and 3 of them are at an even distance from a prey in the proportions 1 : 3 : 3 : 1. On an odd
        torus a path round the torus changes the parity, so the starts are uniform.
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

    def even_predators(self, starts: Starts) -> Counts:
        """Return the number of predators that start at an even distance from each prey: int ``(..., n_prey)``."""
        return (distances(starts, self.config) % 2 == 0).sum(axis=-2)

    def reset_arguments(self, start: Starts) -> dict[str, Any]:
        """Return the arguments of the environment's ``reset`` for a start."""
        return {"options": {"starts": start}}

    def policy_seed(self, start: Starts) -> int:
        """Return the seed with which both teams are reset in an episode from a start."""
        return int(seed_of(start))


class SeedStarts:
    """Starts of any environment: seeds to reset it with, int64 ``(n_trials, n_episodes)``."""

    def __init__(self, n_prey: int) -> None:
        self.n_prey = n_prey

    def draw(self, generator: np.random.Generator, n_trials: int, n_episodes: int) -> EpisodeStarts:
        """Sample seeds."""
        return generator.integers(0, 2**31, (n_trials, n_episodes))

    def held_out(self, generator: np.random.Generator, n_trials: int) -> EpisodeStarts:
        """Sample seeds, one per trial."""
        return self.draw(generator, n_trials, 1)

    def even_predators(self, starts: EpisodeStarts) -> Counts:
        """Return zeros, as the parities of these starts are unknown."""
        return np.zeros((*starts.shape, self.n_prey), int)

    def reset_arguments(self, start: EpisodeStarts) -> dict[str, Any]:
        """Return the arguments of the environment's ``reset`` for a start."""
        return {"seed": int(start)}

    def policy_seed(self, start: EpisodeStarts) -> int:
        """Return the seed with which both teams are reset in an episode from a start."""
        return int(start)


def distances(starts: Starts, config: EnvConfig) -> np.ndarray:
    """Return toroidal Manhattan distances, int ``(..., n_predators, n_prey)``, of starts ``(..., n_agents, 2)``."""
    predators, prey = starts[..., : config.n_predators, None, :], starts[..., None, config.n_predators :, :]
    apart = np.abs(predators - prey)
    return np.minimum(apart, config.size - apart).sum(axis=-1)


def _part(generator: np.random.Generator, starts: Starts, odd: np.ndarray, config: EnvConfig) -> None:
    """Move prey that start on a predator to random cells of the same parity, in place.

    Sample all agents of a start again if many attempts fail.
    """
    tries = 0
    while (met := on_a_predator(starts, config)).any():
        tries += 1
        again = met.any(axis=1)
        fresh = starts[again]
        if tries % _PATIENCE:
            prey = fresh[:, config.n_predators :]
            cells = generator.integers(0, config.size, prey.shape, dtype=prey.dtype)
            cells[..., 0] ^= (cells.sum(axis=-1) + prey.sum(axis=-1)) & 1  # keeps the prey's parity
            prey[met[again]] = cells[met[again]]
        else:  # predators may fill every cell of a parity
            fresh = _with_parities(draw_starts(generator, len(fresh), config), odd[again], config)
        starts[again] = fresh


def _with_parities(starts: Starts, odd: np.ndarray, config: EnvConfig) -> Starts:
    """Return starts in which the agents marked ``odd``, and no others, are at an odd distance from the first prey.

    An agent with the other parity moves to the second cell of a pair of neighbours, so that the cells stay uniform.
    """
    parity = starts.sum(axis=-1) + starts[:, config.n_predators].sum(axis=-1, keepdims=True)
    placed = starts.copy()
    placed[..., 0] ^= ((parity + odd) & 1).astype(placed.dtype)
    return placed
