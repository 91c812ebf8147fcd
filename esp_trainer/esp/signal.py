"""Signal of selection: the part of the differences between neurons that is not sampling noise.

A neuron's score is the mean fitness of its trials, which also depends on the other neurons, the opponents and the
starts. A one-way analysis of variance in each subpopulation, with neurons as groups, estimates how much of the variance
of these means is sampling noise. If all of it is noise, selection is a lottery. If all trials end alike, the side has
lost the gradient (disengagement, section II).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from esp_trainer.arrays import Fitness, NeuronIndices
from esp_trainer.esp.operators import sums_by_neuron


class Signal(NamedTuple):
    """The signal of selection in a generation."""

    share: float
    """Fraction of the variance of neuron fitness within a subpopulation that is not sampling noise. Without signal, the
    estimate may fall below 0. nan if no neuron was in two trials, or if no subpopulation had two neurons in trials."""
    ties: float
    """Fraction of the trials that ended with the most frequent fitness."""


class Variance:
    """Sums of squares over subpopulations, added up agent by agent."""

    def __init__(self) -> None:
        self._between = self._within = 0.0
        self._n_between = self._n_within = 0

    def add(self, chosen: NeuronIndices, fitness: Fitness, size: int) -> None:
        """Add the subpopulations of an agent.

        Args:
            chosen: Index of the neuron of each subpopulation that each trial used, int ``(n_trials, S)``.
            fitness: Fitness of each trial, ``(n_trials,)``.
            size: Number of neurons in a subpopulation.
        """
        n_trials, n_subpopulations = chosen.shape
        centred = fitness - fitness.mean()
        totals, times = sums_by_neuron(chosen, centred, size)
        tested = times > 0
        between = float((totals[tested] ** 2 / times[tested]).sum())
        self._between += between
        self._within += n_subpopulations * float(centred @ centred) - between
        self._n_between += int(tested.sum()) - n_subpopulations
        self._n_within += n_subpopulations * n_trials - int(tested.sum())

    def share(self) -> float:
        """Return :attr:`Signal.share`."""
        if not self._n_between or not self._n_within:
            return float("nan")
        between = self._between / self._n_between
        return 1.0 - self._within / self._n_within / between if between > 0 else 0.0


def ties(fitness: Fitness) -> float:
    """Return :attr:`Signal.ties` of fitness ``(n_trials, n_agents)``, mean over agents."""
    counts = [np.unique(agent, return_counts=True)[1].max() for agent in fitness.T]
    return float(np.mean(counts)) / len(fitness)
