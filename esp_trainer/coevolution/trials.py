"""The trials of a generation: episodes against opponents of several kinds, and their outcome."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from esp_trainer.coevolution.sharing import share
from esp_trainer.config import EspConfig
from esp_trainer.types import Fitness, Role, TeamBatch, TrialResult


@dataclass(frozen=True)
class Part:
    """Episodes of every trial against opponents of one kind."""

    fitness: Fitness = field(repr=False)
    """Fitness of each agent, ``(n_trials, n_episodes, n_agents)``."""
    captured: np.ndarray = field(repr=False)
    """True for each prey that was caught, bool ``(n_trials, n_episodes, n_prey)``."""
    opponents: TeamBatch
    """Opponents of each trial, or of each episode of each trial."""
    past: np.ndarray | None = field(default=None, repr=False)
    """Places of past champions in the hall of fame, int ``(n_trials, n_episodes)``; None for other opponents."""

    @classmethod
    def of(cls, result: TrialResult, role: Role, opponents: TeamBatch, past: np.ndarray | None = None) -> Part:
        """Return one side's part of a result.

        With ``past``, the trials of the result may be single episodes, which are gathered into
        ``(n_trials, n_episodes)``.
        """
        fitness, captured = result.fitness_of(role), result.captured
        if past is not None:
            fitness, captured = fitness.reshape(*past.shape, -1), captured.reshape(*past.shape, -1)
        return cls(fitness, captured, opponents, past)

    @property
    def n_episodes(self) -> int:
        """Number of episodes of each trial."""
        return int(self.fitness.shape[1])

    def shared(self) -> Fitness:
        """Return the shared fitness (:func:`~.sharing.share`), ``(n_trials, n_agents)``, mean over episodes."""
        n_trials, _, n_agents = self.fitness.shape
        met = n_trials if self.opponents.indices is None else len(self.opponents.indices)
        each = share(self.fitness.reshape(met, -1, n_agents).mean(axis=1), self.opponents)
        return each.reshape(n_trials, -1, n_agents).mean(axis=1)


@dataclass(frozen=True)
class Trials:
    """The results of one side's trials."""

    fitness: Fitness = field(repr=False)
    """Mean fitness of each agent over the episodes, ``(n_trials, n_agents)``."""
    earned: Fitness = field(repr=False)
    """Fitness for breeding, ``(n_trials, n_agents)``: after fitness sharing, minus the mean of the block of trials."""
    caught: float
    """Fraction of prey caught."""


def summarise(parts: Sequence[Part], esp: EspConfig) -> Trials:
    """Return the results of trials from their episodes against opponents of each kind."""
    n_episodes = sum(part.n_episodes for part in parts)
    fitness = sum(part.fitness.sum(axis=1) for part in parts) / n_episodes
    caught = sum(part.n_episodes * float(part.captured.mean()) for part in parts) / n_episodes
    earned = fitness
    if esp.fitness_sharing:
        earned = sum(part.n_episodes * part.shared() for part in parts) / n_episodes
    return Trials(fitness, centred(earned, esp.block_size), caught)


def centred(fitness: Fitness, block_size: int) -> Fitness:
    """Return fitness ``(n_trials, n_agents)`` minus its mean over each block of trials.

    Blocks of one trial leave it unchanged.
    """
    if block_size == 1:
        return fitness
    begins = np.arange(0, len(fitness), block_size)
    sizes = np.diff(begins, append=len(fitness))
    means = np.add.reduceat(fitness, begins, axis=0) / sizes[:, None]
    return fitness - np.repeat(means, sizes, axis=0)


def by_block(values: np.ndarray, block_size: int, n_trials: int) -> np.ndarray:
    """Repeat the row of each block for each of its trials."""
    return values if block_size == 1 else np.repeat(values, block_size, axis=0)[:n_trials]
