"""Competitive fitness sharing (Rosin & Belew 1997): beating an opponent that few beat is worth more."""

from __future__ import annotations

import numpy as np

from esp_trainer.arrays import Fitness
from esp_trainer.types import TeamBatch


def share_fitness(fitness: Fitness, opponents: TeamBatch) -> Fitness:
    """Return the fitness of each team as its share of all fitness that was earned against the same opponents.

    Rosin & Belew divide a win among all teams that beat the opponent. A team of ESP is an opponent in one trial only,
    but its neurons are in many. The weight of an opponent is therefore the mean, over its neurons, of 1 / f, where f is
    the fitness earned in all trials against that neuron. If whole teams are opponents repeatedly, as champions are,
    this is the original method.

    Args:
        fitness: ``(n_trials, n_agents)``; values below 0 count as 0.
        opponents: Opponents in each trial. A script, or one team in all trials, makes no difference to the ranking.
    """
    if opponents.indices is None:
        return fitness
    earned = np.maximum(fitness, 0.0)
    met = opponents.indices.reshape(len(fitness), -1)
    size = int(met.max()) + 1
    flat = (met + size * np.arange(met.shape[1])).ravel()
    total = np.bincount(flat, np.repeat(earned.mean(axis=1), met.shape[1]))
    worth = np.zeros_like(total)
    np.divide(1.0, total, out=worth, where=total > 0)
    return earned * worth[flat].reshape(met.shape).mean(axis=1)[:, None]
