"""Estimates of what each neuron contributes to its team, from this generation's trials and, fading, from earlier ones.

One generation's trials tell neurons apart only a little better than a lottery (docs/selection.md). A neuron that
survives has been tried before, and a child has parents that were: both are kept here as sums of fitness beyond the
mean of a generation, so that generations with other opponents can be added up. A score is the mean of such a sum,
shrunk towards 0, the mean of all, the more the fewer trials there are behind it (James & Stein 1961).
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

    def bred(self, parents: np.ndarray, mates: np.ndarray, places: np.ndarray, inheritance: float) -> Estimates:
        """Return the estimates after breeding.

        Args:
            parents: Neurons that breed, int ``(S, n_pairs)``.
            mates: Their mates, likewise; -1 for one that is no neuron of the subpopulation, of which nothing is known.
            places: Neurons that the two children of each pair replace, int ``(S, 2 * n_pairs)``.
            inheritance: What share of its parents' mean a child begins with.
        """
        each = np.arange(len(parents))[:, None]
        known = mates >= 0
        bred = []
        for values in (self.totals, self.trials):
            mean = (values[each, parents] + np.where(known, values[each, mates], 0.0)) / 2
            after = values.copy()
            after[each, places] = np.repeat(inheritance * mean, 2, axis=1)
            bred.append(after)
        return Estimates(*bred)
