"""The trials of a generation: episodes against opponents of several kinds, and their outcome."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from esp_trainer.arrays import EpisodePayoffs, Fitness, Fractions, MemberIndices
from esp_trainer.coevolution.sharing import share_fitness
from esp_trainer.config import EspConfig
from esp_trainer.types import Role, TeamBatch, TrialResult


@dataclass(frozen=True)
class Part:
    """Episodes of every trial against opponents of one kind."""

    fitness: Fitness = field(repr=False)
    """Fitness of each agent, ``(n_trials, n_episodes, n_agents)``."""
    payoff: EpisodePayoffs = field(repr=False)
    """Payoff of each episode to the predators, float64 ``(n_trials, n_episodes)``."""
    mean_payoff: float
    """Mean payoff over all episodes."""
    opponents: TeamBatch
    """Opponents of each trial, or of each episode of each trial."""
    is_share: bool = True
    """True if a payoff runs from 0, a loss, to 1, a win, as a fraction of prey caught does."""
    past: MemberIndices | None = field(default=None, repr=False)
    """Places of past champions in the hall of fame, int ``(n_trials, n_episodes)``; None for other opponents."""

    @classmethod
    def of(cls, result: TrialResult, role: Role, opponents: TeamBatch, past: MemberIndices | None = None) -> Part:
        """Return one side's part of a result.

        With ``past``, the trials of the result may be single episodes, which are gathered into
        ``(n_trials, n_episodes)``.
        """
        fitness, payoff = result.fitness_of(role), result.payoff
        if past is not None:
            fitness, payoff = fitness.reshape(*past.shape, -1), payoff.reshape(past.shape)
        return cls(fitness, payoff, result.mean_payoff, opponents, result.returned is None, past)

    @property
    def n_episodes(self) -> int:
        """Number of episodes of each trial."""
        return int(self.fitness.shape[1])

    def shared(self) -> Fitness:
        """Return the shared fitness (:func:`~.sharing.share_fitness`), ``(n_trials, n_agents)``, mean over episodes."""
        n_trials, _, n_agents = self.fitness.shape
        met = n_trials if self.opponents.indices is None else len(self.opponents.indices)
        each = share_fitness(self.fitness.reshape(met, -1, n_agents).mean(axis=1), self.opponents)
        return each.reshape(n_trials, -1, n_agents).mean(axis=1)


@dataclass(frozen=True)
class Trials:
    """The results of one side's trials."""

    fitness: Fitness = field(repr=False)
    """Mean fitness of each agent over the episodes, ``(n_trials, n_agents)``."""
    earned: Fitness = field(repr=False)
    """Fitness for breeding, ``(n_trials, n_agents)``: after fitness sharing, minus the mean of the block of trials."""
    payoff: float
    """Mean payoff to the predators: in the predator-prey world the fraction of prey caught."""


def summarise_trials(parts: Sequence[Part], esp: EspConfig) -> Trials:
    """Return the results of trials from their episodes against opponents of each kind."""
    n_episodes = sum(part.n_episodes for part in parts)
    fitness = sum(part.fitness.sum(axis=1) for part in parts) / n_episodes
    payoff = sum(part.n_episodes * part.mean_payoff for part in parts) / n_episodes
    earned = fitness
    if esp.fitness_sharing:
        earned = sum(part.n_episodes * part.shared() for part in parts) / n_episodes
    return Trials(fitness, centred(earned, esp.block_size), payoff)


def ranked(payoff: EpisodePayoffs) -> Fractions:
    """Return the rank of each payoff among all, from 0 for the lowest to 1 for the highest, float64 of the same shape.

    Equal payoffs share their mean rank. This turns payoffs of any scale into results from 0 to 1, with a mean of 0.5.
    """
    _, which, counts = np.unique(payoff, return_inverse=True, return_counts=True)
    middle = np.cumsum(counts) - (counts + 1) / 2
    return (middle / max(1, payoff.size - 1))[which].reshape(payoff.shape) if payoff.size > 1 else payoff * 0 + 0.5


def centred(fitness: Fitness, block_size: int) -> Fitness:
    """Return fitness ``(n_trials, n_agents)`` minus its mean over each block of trials.

    If a block is one trial, the fitness is unchanged.
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
