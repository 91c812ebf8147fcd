"""Competitive fitness sharing (Rosin & Belew 1997): beating those whom few beat is worth more."""

from __future__ import annotations

import numpy as np

from esp_trainer.types import EvolvedTeams, Fitness, Teams


def share(fitness: Fitness, opponents: Teams) -> Fitness:
    """What each trial's team earned, as its share of all that was earned against the same opponents.

    Rosin & Belew divide a win among all who beat that opponent. A team of ESP is met in one trial only, but its neurons
    are in many; so an opponent's worth is the mean, over its neurons, of one over what was earned in all trials that
    met that neuron. Where whole teams are met again, as champions are, this is the original.

    Args:
        fitness: ``(n_trials, n_agents)``; what is below 0 counts as 0.
        opponents: Whom each trial met; a script, or one team in all trials, makes no difference to the ranking.
    """
    if not isinstance(opponents, EvolvedTeams):
        return fitness
    earned = np.maximum(fitness, 0.0)
    met = opponents.indices.reshape(len(fitness), -1)
    size = opponents.genomes.shape[3]
    flat = (met + size * np.arange(met.shape[1])).ravel()
    total = np.bincount(flat, np.repeat(earned.mean(axis=1), met.shape[1]))
    worth = np.zeros_like(total)
    np.divide(1.0, total, out=worth, where=total > 0)
    return np.asarray(earned * worth[flat].reshape(met.shape).mean(axis=1)[:, None])
