"""Hand-made episodes, written as moves: ``"EEN."`` is two steps east, one north, and one idle."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import pytest

from esp_trainer.analysis.behaviours.paths import Paths

STEPS = {"E": (1, 0), "W": (-1, 0), "N": (0, 1), "S": (0, -1), ".": (0, 0)}
SIZE = 100

Walk = tuple[tuple[int, int], str]
AWAY = [((0, 0), ""), ((10, 97), ""), ((95, 15), "")]
"""Predators that idle far from the middle, where the episodes play."""


class Scene(NamedTuple):
    """One episode: who starts where, and goes how. Who has no moves left stands still."""

    predators: Sequence[Walk]
    prey: Sequence[Walk]
    n_rows: int | None = None
    """Rows of the trace, if it goes on after the end."""

    def trace(self, size: int = SIZE) -> np.ndarray:
        """int ``(1, n_rows, n_agents, 2)``."""
        walks = [*self.predators, *AWAY[len(self.predators) :], *self.prey]
        length = max(len(moves) for _, moves in walks)
        cells = [
            np.cumsum([start, *(STEPS[move] for move in moves.ljust(length, "."))], axis=0) for start, moves in walks
        ]
        trace = np.full((1, self.n_rows or length + 1, len(walks), 2), -1)
        trace[0, : length + 1] = np.stack(cells, axis=1) % size
        return trace

    def paths(self) -> Paths:
        """The same as paths; always three predators."""
        return Paths.of_trace(self.trace(), 3, SIZE)


CHASE = ((46, 50), "E" * 16 + "N" * 8)  # follows ((50, 50), "E" * 12 + "N" * 12), cutting no corner
FROM_WEST = ((32, 48), "E" * 7 + "N" + "E" * 7 + "N")
FROM_EAST = ((68, 48), "W" * 7 + "N" + "W" * 7 + "N")

POSITIVES = {
    "attacker": Scene([CHASE], [((50, 50), "E" * 12 + "N" * 12)]),
    "blocker": Scene([((70, 50), "NS" * 8)], [((50, 50), "E" * 16)]),
    "role switch": Scene([((72, 50), "." * 16 + "WN" * 6 + "N" * 6)], [((50, 50), "E" * 16 + "N" * 18)]),
    "opposing attack": Scene([FROM_WEST, FROM_EAST], [((50, 50), "NS" * 8)]),
    "encirclement": Scene(
        [((32, 53), "E" * 14), ((68, 53), "W" * 14), ((50, 34), "N" * 14)],
        [((50, 50), "NS" * 7)],
    ),
    "circling": Scene([((50, 51), "S" + "ENWS" * 4)], [((50, 50), "ENWS" * 4 + "E")]),
    "baiting": Scene(
        [((37, 50), "E" * 12 + "N" * 8), ((63, 50), "W" * 12 + "N" * 8)],
        [((50, 50), "EW" * 5 + "N" * 10)],
    ),
    "sidestepping": Scene([((70, 50), "")], [((50, 50), "E" * 15 + "N" + "E" * 10)]),
    "reversal": Scene(
        [((50, 66), ""), ((50, 46), "N" * 14)],
        [((50, 50), "N" * 10 + "W" + "S" * 12)],
    ),
    "herding": Scene(
        [((26, 50), "E" * 12), ((66, 52), "W" * 12)],
        [((30, 50), "E" * 12 + "NS" * 4), ((62, 52), "W" * 12 + "NS" * 4)],
    ),
    "simultaneous capture": Scene(
        [((45, 50), "E" * 5), ((4, 20), "E" * 8)],
        [((55, 50), "W" * 5), ((20, 20), "W" * 8)],
        n_rows=20,
    ),
    "scattering": Scene(
        [((51, 65), "S" * 10), ((51, 35), "N" * 10)],
        [((50, 50), "EW" * 5 + "W" * 10), ((52, 50), "EW" * 5 + "E" * 10)],
    ),
}
"""Each plainly what its name says."""


@pytest.fixture(scope="session")
def scene() -> type[Scene]:
    """The class :class:`Scene`."""
    return Scene


@pytest.fixture(scope="session")
def positives() -> dict[str, Scene]:
    """One episode for each behaviour that is or is not there."""
    return POSITIVES


@pytest.fixture(scope="session")
def wander() -> Callable[..., np.ndarray]:
    """``wander(n_episodes, n_prey, straight=False, seed=0)``: a trace of three predators and prey that walk at random,
    or straight on in a random direction, from random cells.
    """

    def draw(n_episodes: int, n_prey: int, straight: bool = False, seed: int = 0, n_steps: int = 150) -> np.ndarray:
        generator = np.random.default_rng(seed)
        directions = np.array([STEPS[move] for move in "EWNS."])
        start = generator.integers(0, SIZE, (n_episodes, 1, 3 + n_prey, 2))
        moves = generator.integers(0, 4 if straight else 5, (n_episodes, n_steps, 3 + n_prey))
        moves[:, :, 3:] = generator.integers(0, 4, (n_episodes, n_steps, n_prey))
        if straight:
            moves[:] = moves[:, :1]
        return np.concatenate([start, start + np.cumsum(directions[moves], axis=1)], axis=1) % SIZE

    return draw
