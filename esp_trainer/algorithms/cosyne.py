"""Cooperative Synapse Neuroevolution: a subpopulation for each gene (Gomez, Schmidhuber & Miikkulainen, JMLR 2008)."""

from __future__ import annotations

import numpy as np

from esp_trainer.algorithms.genetic import GeneticAlgorithm
from esp_trainer.arrays import Fitness, TeamVectors


class Cosyne(GeneticAlgorithm):
    """CoSyNE: teams breed as in a genetic algorithm, then the values of each gene are permuted between teams.

    Each value of a team that was played is permuted with probability ``1 - q ** (1 / n)``, where ``q`` is the team's
    fitness, from 0 for the worst to 1 for the best, and ``n`` its number of genes. The values of children always are.
    Each team is thus a new combination of gene values, as a team of ESP is a new combination of neurons.

    Option: ``n_teams``, as in :class:`GeneticAlgorithm`.
    """

    def learn(self, vectors: TeamVectors, scores: Fitness, generator: np.random.Generator) -> None:
        """Replace the worst teams by children of the best, and permute the values of each gene."""
        super().learn(vectors, scores, generator)
        n, ranked = len(vectors), np.sort(scores)[::-1]
        n_kept = n - 2 * max(1, int(self.config.elite_share * n))
        span = ranked[0] - ranked[-1]
        quality = (ranked - ranked[-1]) / span if span > 0 else np.zeros(n)
        probability = np.ones(n)
        probability[:n_kept] = 1.0 - quality[:n_kept] ** (1.0 / self.n_parameters)
        marked = generator.random(vectors.shape) < probability[:, None]
        for gene in range(self.n_parameters):
            places = np.flatnonzero(marked[:, gene])
            self.population[places, gene] = self.population[generator.permutation(places), gene]
