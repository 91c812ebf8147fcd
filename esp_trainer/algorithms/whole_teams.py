"""Base of algorithms that breed whole teams, each a vector of all its genes."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar, Self

import numpy as np

from esp_trainer.algorithm import Spread
from esp_trainer.algorithms.registry import algorithm_name
from esp_trainer.arrays import Fitness, StoredArray, TeamGenomes, TeamVector, TeamVectors
from esp_trainer.config import EspConfig
from esp_trainer.esp import operators
from esp_trainer.esp.signal import Variance
from esp_trainer.esp.team import as_candidates
from esp_trainer.networks.controller import Controller
from esp_trainer.types import EvolvedTeams
from predprey_env.settings import PartError

NO_OPTIONS: Mapping[str, Any] = MappingProxyType({})


class WholeTeams(ABC):
    """A population of whole teams. A subclass defines which vectors are played, and how it learns from their scores.

    In each round of trials every team plays once, in random order, so that the trials of a block, which have the same
    starts, hold different teams.

    Args:
        config: Parameters of evolution.
        controller: The networks of each agent.
        n_genomes: Number of genomes of a team.
        options: Values of some of :attr:`OPTIONS`.
    """

    OPTIONS: ClassVar[Mapping[str, float]] = {}
    """Options and their defaults; a default of 0 may mean that the value is computed from the config."""

    def __init__(
        self, config: EspConfig, controller: Controller, n_genomes: int, options: Mapping[str, Any] = NO_OPTIONS
    ) -> None:
        self.config = config
        self.options = {**self.OPTIONS, **_checked(options, self.OPTIONS)}
        self.controller = controller
        self.shape = n_genomes, *controller.shape
        """Shape of a team's genes, ``(n_genomes, n_networks, n_hidden, n_genes)``."""
        used = np.arange(controller.n_genes) < np.array(controller.used_genes)[:, None, None]
        self._used = np.broadcast_to(used, self.shape)
        self.n_parameters = int(self._used.sum())
        """Length of a team's vector: the genes that its networks read."""
        self.neurons = np.tile(np.repeat(controller.used_genes, controller.n_hidden), n_genomes)
        """Number of genes of each neuron, in the order of the vector."""
        self._asked: np.ndarray | None = None
        self._vectors = np.empty((0, self.n_parameters), np.float32)

    @classmethod
    def start(
        cls,
        config: EspConfig,
        controller: Controller,
        n_genomes: int,
        generator: np.random.Generator,
        **options: Any,
    ) -> Self:
        """Return the algorithm before the first generation; see :class:`~esp_trainer.algorithm.Algorithm`."""
        made = cls(config, controller, n_genomes, options)
        made.begin(generator)
        return made

    # -- what a subclass defines ----------------------------------------------------------------------------------

    @abstractmethod
    def begin(self, generator: np.random.Generator) -> None:
        """Set up the population."""

    @abstractmethod
    def vectors(self, generator: np.random.Generator) -> TeamVectors:
        """Return the teams of a generation, ``(n_teams, n_parameters)``."""

    @abstractmethod
    def learn(self, vectors: TeamVectors, scores: Fitness, generator: np.random.Generator) -> None:
        """Update the population by the mean fitness of each team, ``(n_teams,)``; higher is better."""

    @abstractmethod
    def around(self, vector: TeamVector, generator: np.random.Generator) -> None:
        """Start again around a vector, ``(n_parameters,)``."""

    @abstractmethod
    def state(self) -> dict[str, StoredArray]:
        """Return the state as arrays."""

    @abstractmethod
    def restore(self, state: Mapping[str, StoredArray]) -> None:
        """Restore a state."""

    # -- what coevolution calls -----------------------------------------------------------------------------------

    def ask(self, generator: np.random.Generator) -> EvolvedTeams:
        """Return the teams of a generation's trials."""
        vectors = np.asarray(self.vectors(generator), np.float32)
        needed = f"algorithm {algorithm_name(self)}: vectors() must return"
        if vectors.ndim != 2 or vectors.shape[1] != self.n_parameters or not len(vectors):
            raise PartError(f"{needed} (n_teams, {self.n_parameters}), got shape {vectors.shape}")
        if not np.isfinite(vectors).all():
            raise PartError(f"{needed} finite genes, got NaN or infinity")
        rounds = -(-self.config.n_trials // len(vectors))
        order = np.concatenate([generator.permutation(len(vectors)) for _ in range(rounds)])[: self.config.n_trials]
        self._vectors, self._asked = vectors, order
        indices = order.astype(np.min_scalar_type(len(vectors) - 1))[:, None, None, None]
        indices = np.broadcast_to(indices, (len(order), *self.shape[:3]))
        return EvolvedTeams(self.controller, as_candidates(self.genomes_of(vectors)), indices)

    def tell(self, fitness: Fitness, champions: TeamGenomes, generator: np.random.Generator) -> float:  # noqa: ARG002
        """Breed by the fitness of each agent in each trial, ``(n_trials, n_agents)``; champions are not used."""
        if self._asked is None:
            raise RuntimeError("tell() needs the teams of ask() first")
        if len(fitness) != len(self._asked) or not np.isfinite(fitness).all():
            raise ValueError(f"fitness must be finite, of {len(self._asked)} trials, got shape {fitness.shape}")
        earned, chosen, variance = fitness.mean(axis=1), self._asked[:, None], Variance()
        variance.add(chosen, earned, len(self._vectors))
        totals, times = operators.sums_by_neuron(chosen, earned, len(self._vectors))
        worst = earned.min()  # a team that had no trial counts as the worst
        scores = np.where(times[0] > 0, totals[0] / np.maximum(times[0], 1), worst)
        self._asked = None
        self.learn(self._vectors, scores, generator)
        return variance.share()

    def spread(self) -> Spread:
        """Return the diversity and the scale of the asked teams' genes."""
        vectors = self._vectors.astype(np.float64)
        return Spread(float(vectors.std(axis=0).mean()), float(np.abs(vectors).mean()))

    def burst(self, champion: TeamGenomes, generator: np.random.Generator) -> None:
        """Start again around a champion, ``(n_genomes, n_networks, n_hidden, n_genes)``."""
        self.around(champion[self._used], generator)

    @property
    def n_teams(self) -> int:
        """Number of teams in a population: the option ``n_teams``; by default ``esp.subpopulation_size``, or
        ``esp.n_trials`` if that is smaller.
        """
        most = self.config.n_trials
        n_teams = int(self.options.get("n_teams", 0)) or min(self.config.subpopulation_size, most)
        if n_teams < 4:
            raise ValueError(f"option n_teams must be at least 4, got {n_teams}")
        if n_teams > most:
            at_most = f"esp.n_trials={most}, as each team needs a trial"
            raise ValueError(f"option n_teams must be at most {at_most}, got {n_teams}")
        return n_teams

    def genomes_of(self, vectors: TeamVectors) -> TeamGenomes:
        """Return the genes of teams, float32 ``(n_teams, *shape)``; genes that no network reads are 0."""
        genomes = np.zeros((len(vectors), *self.shape), np.float32)
        genomes[:, self._used] = vectors
        return genomes

    def first_vectors(self, n: int, generator: np.random.Generator) -> TeamVectors:
        """Return ``n`` random teams, float32, uniform as in ESP."""
        limit = self.config.init_range
        return generator.uniform(-limit, limit, (n, self.n_parameters)).astype(np.float32)


def _checked(options: Mapping[str, Any], known: Mapping[str, float]) -> Mapping[str, Any]:
    for name, value in options.items():
        if name not in known:
            there = f"there are {', '.join(known)}" if known else "there are none"
            raise ValueError(f"unknown option {name}; {there}")
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0 <= value < math.inf:
            raise ValueError(f"option {name} must be a finite number of at least 0, got {value!r}")
    return options
