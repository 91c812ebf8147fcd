"""Estimates of what each neuron contributes to its team, from this generation's trials and, fading, from earlier ones.

One generation's trials tell neurons apart only a little better than a lottery. A neuron that survives has been tried
before: its trials are kept here as a sum of fitness beyond the mean of each generation, so that generations with other
opponents can be added up. A score is the mean of such a sum, shrunk towards 0, the mean of all, the more the fewer
trials there are behind it (James & Stein 1961).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from esp_trainer.types import Fitness


@dataclass(frozen=True)
class Estimates:
    """What is known of the neurons of ``S`` subpopulations, ``P`` in each."""

    totals: np.ndarray
    """Fitness beyond the mean, summed over trials, float64 ``(S, P)``."""
    trials: np.ndarray
    """Trials behind it, earlier ones counted in part, float64 ``(S, P)``."""

    @classmethod
    def none(cls, n_subpopulations: int, size: int) -> Estimates:
        """Return estimates before the first trial."""
        return cls(np.zeros((n_subpopulations, size)), np.zeros((n_subpopulations, size)))

    def after(self, totals: np.ndarray, trials: np.ndarray, memory: float) -> Estimates:
        """Return the estimates after a generation's trials; of earlier ones the share ``memory`` counts on."""
        return Estimates(memory * self.totals + totals, memory * self.trials + trials)

    def scores(self, prior: float) -> Fitness:
        """Return shrunken means ``(S, P)``: as if each neuron had taken part in ``prior`` more trials of mean fitness.
        Without any trials it is -inf.
        """
        behind = self.trials + prior
        scores = np.full_like(behind, -np.inf)
        np.divide(self.totals, behind, out=scores, where=behind > 0)
        return scores

    def without(self, replaced: np.ndarray) -> Estimates:
        """Return the estimates after some neurons were replaced, int ``(S, n)``: nothing is known of those."""
        known = np.ones(self.trials.shape)
        np.put_along_axis(known, replaced, 0.0, axis=1)
        return Estimates(self.totals * known, self.trials * known)
