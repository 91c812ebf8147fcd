"""A plain genetic algorithm on whole teams: what ESP is without subpopulations."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from esp_trainer.algorithm import restored
from esp_trainer.algorithms.whole_teams import WholeTeams
from esp_trainer.arrays import Fitness, StoredArray, TeamVector, TeamVectors
from esp_trainer.esp import operators


class GeneticAlgorithm(WholeTeams):
    """Truncation selection, one-point crossover and mutation, with the parameters of ``esp``.

    The best ``elite_share`` of the teams breed. Each mates with a random one of them. Their two children, from a cut at
    one point of the whole vector, replace the worst teams. In each neuron of a child one gene changes with probability
    ``mutation_rate``, as in ESP.

    Option: ``n_teams``, the number of teams, see :attr:`WholeTeams.n_teams`.
    """

    OPTIONS: ClassVar[Mapping[str, float]] = {"n_teams": 0}

    def begin(self, generator: np.random.Generator) -> None:
        """Start from random teams."""
        self.population = self.first_vectors(self.n_teams, generator)

    def vectors(self, generator: np.random.Generator) -> TeamVectors:  # noqa: ARG002
        """Return the population."""
        return self.population

    def learn(self, vectors: TeamVectors, scores: Fitness, generator: np.random.Generator) -> None:
        """Replace the worst teams by children of the best."""
        ranked = vectors[np.argsort(-scores, kind="stable")]
        children = self.children(ranked, generator)
        self.population = np.concatenate([ranked[: len(ranked) - len(children)], children])

    def children(self, ranked: TeamVectors, generator: np.random.Generator) -> TeamVectors:
        """Return two children for each elite team; ``ranked`` holds the teams from best to worst."""
        n_elite = max(1, int(self.config.elite_share * len(ranked)))
        elite, length = ranked[None, :n_elite], np.array([self.n_parameters])
        mates = elite[:, generator.integers(0, n_elite, n_elite)]
        children = operators.one_point_crossover(generator, elite, mates, length)[0]
        self.mutate(children, generator)
        return children

    def mutate(self, vectors: TeamVectors, generator: np.random.Generator) -> None:
        """Change one gene of each neuron with probability ``mutation_rate``, in place."""
        config, first = self.config, np.cumsum(self.neurons) - self.neurons
        mutants = np.nonzero(generator.random((len(vectors), len(self.neurons))) < config.mutation_rate)
        genes = first[mutants[1]] + generator.integers(0, self.neurons[mutants[1]])
        changes = operators.truncated_cauchy(generator, len(genes), config.mutation_scale, config.mutation_limit)
        vectors[mutants[0], genes] += changes.astype(np.float32)

    def around(self, vector: TeamVector, generator: np.random.Generator) -> None:
        """Start again from a team and copies of it with Cauchy-distributed changes."""
        config, shape = self.config, self.population.shape
        spread = operators.truncated_cauchy(
            generator, self.population.size, config.burst_scale, config.mutation_limit
        ).reshape(shape)
        spread[0] = 0.0
        self.population = (vector + spread).astype(np.float32)

    def state(self) -> dict[str, StoredArray]:
        """Return the population."""
        return {"population": self.population}

    def restore(self, state: Mapping[str, StoredArray]) -> None:
        """Restore a population."""
        self.population = restored(state, "population", self.population)
