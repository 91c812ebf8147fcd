"""Evolution strategies of Salimans, Ho, Chen, Sidor & Sutskever (2017, arXiv:1703.03864), with Adam."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from esp_trainer.algorithm import restored
from esp_trainer.algorithms.whole_teams import WholeTeams
from esp_trainer.arrays import Fitness, StoredArray, TeamVector, TeamVectors

_BETAS, _EPSILON = (0.9, 0.999), 1e-8  # of Adam (Kingma & Ba 2015)


class OpenAIES(WholeTeams):
    """A mean team that follows the gradient estimated from pairs of opposite perturbations of it.

    A generation's teams are the mean itself, which can become the champion, and as many pairs as the trials allow.
    Scores are replaced by centred ranks.

    Options: ``sigma``, the standard deviation of a perturbation; ``learning_rate``, the step size of Adam;
    ``weight_decay``, the fraction by which each gene shrinks at each step.
    """

    OPTIONS: ClassVar[Mapping[str, float]] = {"sigma": 1.0, "learning_rate": 0.3, "weight_decay": 0.005}

    def begin(self, generator: np.random.Generator) -> None:
        """Start from a random team."""
        self.mean = self.first_vectors(1, generator)[0].astype(np.float64)
        self.moments = np.zeros((2, self.n_parameters))
        self.steps = np.zeros(1, np.int64)

    def vectors(self, generator: np.random.Generator) -> TeamVectors:
        """Return the mean, and pairs of opposite perturbations of it."""
        n_pairs = max(1, (self.config.n_trials - 1) // 2)
        self._noise = generator.standard_normal((n_pairs, self.n_parameters))
        both = np.concatenate([self._noise, -self._noise])
        return np.concatenate([self.mean[None], self.mean + self.options["sigma"] * both])

    def learn(self, vectors: TeamVectors, scores: Fitness, generator: np.random.Generator) -> None:  # noqa: ARG002
        """Move the mean along the estimated gradient."""
        perturbed = scores[1:]
        ranks = np.argsort(np.argsort(perturbed, kind="stable"), kind="stable") / (len(perturbed) - 1) - 0.5
        n_pairs, options = len(self._noise), self.options
        gradient = (ranks[:n_pairs] - ranks[n_pairs:]) @ self._noise / (2 * n_pairs * options["sigma"])
        self.steps += 1
        for moment, beta, seen in zip(self.moments, _BETAS, (gradient, gradient**2), strict=True):
            moment += (1 - beta) * (seen - moment)
        first, second = (m / (1 - beta ** self.steps[0]) for m, beta in zip(self.moments, _BETAS, strict=True))
        step = options["learning_rate"] * first / (np.sqrt(second) + _EPSILON)
        self.mean = (1 - options["weight_decay"]) * self.mean + step

    def around(self, vector: TeamVector, generator: np.random.Generator) -> None:  # noqa: ARG002
        """Go on from a vector, without momentum."""
        self.mean, self.moments = vector.astype(np.float64), np.zeros((2, self.n_parameters))
        self.steps[:] = 0

    def state(self) -> dict[str, StoredArray]:
        """Return the mean and the state of Adam."""
        return {"mean": self.mean, "moments": self.moments, "steps": self.steps}

    def restore(self, state: Mapping[str, StoredArray]) -> None:
        """Restore the mean and the state of Adam."""
        self.mean, self.moments, self.steps = (restored(state, name, like) for name, like in self.state().items())
