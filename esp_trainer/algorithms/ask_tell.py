"""Base class for optimisers of other libraries with ``ask`` and ``tell``, and CMA-ES by the package ``cma``."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, ClassVar

import numpy as np

from esp_trainer.algorithms.registry import algorithm_name
from esp_trainer.algorithms.whole_teams import WholeTeams
from esp_trainer.arrays import Fitness, StoredArray, TeamVector, TeamVectors
from predprey_env.extras import extra
from predprey_env.settings import PartError


class AskTell(WholeTeams):
    """An algorithm whose teams are the solutions of an optimiser.

    The optimiser is an object with ``ask() -> solutions`` and ``tell(solutions, losses)``, where lower losses are
    better. A subclass makes it in :meth:`optimiser`. A checkpoint holds the seed of each call and all losses since the
    start. A resumed run repeats these calls on a new optimiser, which takes a fraction of the time of the run.
    Optimisers may sample from NumPy's global generator: it is seeded for each call.
    """

    @abstractmethod
    def optimiser(self, start: TeamVector, seed: int) -> Any:
        """Return an optimiser that starts from a vector, float64 ``(n_parameters,)``."""

    def begin(self, generator: np.random.Generator) -> None:
        """Start the optimiser from a random team."""
        self.around(self.first_vectors(1, generator)[0], generator)

    def around(self, vector: TeamVector, generator: np.random.Generator) -> None:
        """Start the optimiser from a vector."""
        self._begin(vector.astype(np.float64), int(generator.integers(2**31)))

    def vectors(self, generator: np.random.Generator) -> TeamVectors:
        """Return the solutions that the optimiser asks for."""
        return self._ask(int(generator.integers(2**31)))

    def learn(self, vectors: TeamVectors, scores: Fitness, generator: np.random.Generator) -> None:  # noqa: ARG002
        """Tell the optimiser the losses of its solutions."""
        self._tell(-scores, int(generator.integers(2**31)))

    def state(self) -> dict[str, StoredArray]:
        """Return the starting vector, the seed of each call, and the losses of each generation since the start."""
        losses = np.array(self._losses) if self._losses else np.zeros((0, 0))  # none yet after a start or a burst
        return {"start": self._start, "seeds": np.array(self._seeds, np.int64), "losses": losses}

    def restore(self, state: Mapping[str, StoredArray]) -> None:
        """Repeat the calls of the saved optimiser on a new one."""
        start, seeds, losses = (state[name] for name in ("start", "seeds", "losses"))
        if start.shape != (self.n_parameters,) or len(seeds) != 1 + 2 * len(losses):
            raise ValueError(f"start, seeds and losses do not fit: {start.shape}, {seeds.shape}, {losses.shape}")
        self._begin(start.copy(), int(seeds[0]))
        for told, ask, tell in zip(losses, seeds[1::2].tolist(), seeds[2::2].tolist(), strict=True):
            self._ask(ask)
            self._tell(told, tell)

    def _begin(self, start: TeamVector, seed: int) -> None:
        self._start, self._seeds, self._losses = start, [seed], list[np.ndarray]()
        with _seeded(seed):
            self._optimiser = self.optimiser(start, seed)
        if not all(callable(getattr(self._optimiser, call, None)) for call in ("ask", "tell")):
            kind = type(self._optimiser).__name__
            needed = f"algorithm {algorithm_name(self)}: optimiser() must return an object with ask() and tell()"
            raise PartError(f"{needed}, got {kind}")

    def _ask(self, seed: int) -> TeamVectors:
        self._asked_with = seed
        with _seeded(seed):
            self._solutions = self._optimiser.ask()
        return np.asarray(self._solutions)

    def _tell(self, losses: np.ndarray, seed: int) -> None:
        with _seeded(seed):
            self._optimiser.tell(self._solutions, losses.tolist())
        self._seeds += [self._asked_with, seed]
        self._losses.append(losses)


@contextmanager
def _seeded(seed: int) -> Iterator[None]:
    """Seed NumPy's global generator, and put it back afterwards."""
    before = np.random.get_state()
    np.random.seed(seed)
    try:
        yield
    finally:
        np.random.set_state(before)


def _normal(*shape: int) -> np.ndarray:
    """Sample from NumPy's global generator; a deep copy of ``np.random.randn`` itself would have one of its own."""
    return np.random.standard_normal(shape)


class CmaES(AskTell):
    """CMA-ES (Hansen & Ostermeier 2001), by the package ``cma``.

    Options: ``sigma``, the initial standard deviation; ``n_teams``, the number of teams in a generation, see
    :attr:`WholeTeams.n_teams`.
    """

    OPTIONS: ClassVar[Mapping[str, float]] = {"sigma": 1.0, "n_teams": 0}

    def optimiser(self, start: TeamVector, seed: int) -> Any:
        """Return a CMA-ES."""
        with extra("algorithms", "cma_es"):
            import cma
        settings = {"popsize": self.n_teams, "seed": seed or 1, "randn": _normal, "verbose": -9}
        return cma.CMAEvolutionStrategy(start, self.options["sigma"], settings)
