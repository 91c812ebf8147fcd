"""Estimates of each neuron's contribution to its team, from the trials of this and, discounted, earlier generations.

One generation's trials tell neurons apart only a little better than a lottery. A neuron that survives also has earlier
trials. Each neuron's fitness minus the mean of its generation is summed over trials, so that generations with different
opponents can be added up. A score is the mean of this sum, shrunk towards 0, the mean of all neurons: the fewer the
trials, the more it shrinks (James & Stein 1961).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from esp_trainer.arrays import Fitness, NeuronIndices


@dataclass(frozen=True)
class Estimates:
    """Sums over the trials of the neurons of ``S`` subpopulations, ``P`` in each."""

    totals: Fitness
    """Fitness minus the generation's mean, summed over trials, float64 ``(S, P)``."""
    trials: np.ndarray
    """Number of trials in each sum, earlier ones discounted, float64 ``(S, P)``."""

    @classmethod
    def none(cls, n_subpopulations: int, size: int) -> Estimates:
        """Return the estimates before the first trial."""
        return cls(np.zeros((n_subpopulations, size)), np.zeros((n_subpopulations, size)))

    def after(self, totals: Fitness, trials: np.ndarray, memory: float) -> Estimates:
        """Return the estimates after a generation's trials. Earlier trials are multiplied by ``memory``."""
        return Estimates(memory * self.totals + totals, memory * self.trials + trials)

    def scores(self, prior: float) -> Fitness:
        """Return shrunken means ``(S, P)``, as if each neuron had taken part in ``prior`` more trials of mean fitness.

        If ``prior`` is 0, neurons without trials score -inf.
        """
        behind = self.trials + prior
        scores = np.full_like(behind, -np.inf)
        np.divide(self.totals, behind, out=scores, where=behind > 0)
        return scores

    def without(self, replaced: NeuronIndices) -> Estimates:
        """Return the estimates after some neurons, int ``(S, n)``, were replaced: the new ones have no trials."""
        known = np.ones(self.trials.shape)
        np.put_along_axis(known, replaced, 0.0, axis=1)
        return Estimates(self.totals * known, self.trials * known)
