"""The protocol of algorithms that breed a side in coevolution."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol, Self

import numpy as np

from esp_trainer.arrays import Fitness, StoredArray, TeamGenomes
from esp_trainer.config import EspConfig
from esp_trainer.networks.controller import Controller
from esp_trainer.types import EvolvedTeams


class Spread(NamedTuple):
    """Diversity and scale of the genes of a side's teams."""

    diversity: float
    """Standard deviation of a gene, mean over genes."""
    scale: float
    """Mean absolute value of a gene."""


class Algorithm(Protocol):
    """Breeds the teams of one side, generation by generation.

    In each generation coevolution calls :meth:`ask`, plays the teams, and calls :meth:`tell`. It works on a deep copy,
    so a generation that fails leaves nothing behind. All random numbers come from the given generators: the same config
    and seed then give the same bytes.
    """

    controller: Controller
    """The networks of each agent."""

    @classmethod
    def start(
        cls,
        config: EspConfig,
        controller: Controller,
        n_genomes: int,
        generator: np.random.Generator,
        **options: Any,
    ) -> Self:
        """Return the algorithm before the first generation.

        Args:
            config: Parameters of evolution; an algorithm ignores those that do not apply to it.
            controller: The networks of each agent.
            n_genomes: Number of genomes of a team: one for each agent, or one for all if the controller is central.
            generator: Random generator of the first genes.
            options: Options of the algorithm, from the config's ``algorithm_options``.
        """
        ...

    def ask(self, generator: np.random.Generator) -> EvolvedTeams:
        """Return the teams of a generation's trials, ``config.n_trials`` of them. The same team may be in several."""
        ...

    def tell(self, fitness: Fitness, champions: TeamGenomes, generator: np.random.Generator) -> float | None:
        """Breed the next generation. Return the signal of selection, see :class:`~esp_trainer.esp.signal.Signal`.

        Args:
            fitness: Fitness of each agent of each asked team, float64 ``(n_trials, n_agents)``; higher is better.
            champions: The side's earlier champions, float32 ``(n_champions, n_genomes, n_networks, n_hidden,
                n_genes)``.
            generator: Random generator of this generation's breeding.
        """
        ...

    def spread(self) -> Spread:
        """Return the diversity and the scale of the genes of the asked teams."""
        ...

    def burst(self, champion: TeamGenomes, generator: np.random.Generator) -> None:
        """Start again around a champion, float32 ``(n_genomes, n_networks, n_hidden, n_genes)``."""
        ...

    def state(self) -> dict[str, StoredArray]:
        """Return everything that the next generation depends on, as arrays for the checkpoint."""
        ...

    def restore(self, state: Mapping[str, StoredArray]) -> None:
        """Restore the state that :meth:`state` returned.

        Raises :class:`ValueError` or :class:`KeyError` if the arrays are not such a state.
        """
        ...


def restored(state: Mapping[str, StoredArray], name: str, like: StoredArray) -> StoredArray:
    """Return an array of a state; raise :class:`ValueError` unless it has the type and shape of ``like``."""
    array = state[name]
    if array.shape != like.shape or array.dtype != like.dtype:
        raise ValueError(f"{name} must be {like.dtype} of shape {like.shape}, got {array.dtype} of shape {array.shape}")
    return array.copy()
