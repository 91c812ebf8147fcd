"""Where everybody went: traces made continuous, so that a step over the seam of the toroid is a step like any other."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np


def minimal_image(way: np.ndarray, size: int) -> np.ndarray:
    """Ways along an axis, in cells, by the shortest way round: in ``[-(size // 2), size - size // 2 - 1]``, as
    :func:`predprey_env.torus.displacement` takes them.
    """
    half = size // 2
    return np.asarray((way + half) % size - half)


@dataclass(frozen=True, eq=False)
class Paths:
    """The motions of a set of episodes. All arrays begin ``(n_episodes, n_rows, ...)``; row 0 is the start, row ``t``
    is after step ``t``, and rows after the end of an episode repeat its last one.
    """

    predators: np.ndarray
    """Unwrapped cells (x, y), int32 ``(n_episodes, n_rows, n_predators, 2)``: east is +x, north is +y."""

    prey: np.ndarray
    """Unwrapped cells, int32 ``(n_episodes, n_rows, n_prey, 2)``."""

    lengths: np.ndarray
    """The last row of each episode, int ``(n_episodes,)``."""

    capture_times: np.ndarray
    """The row at which each prey is caught, or ``n_rows`` if it never is: int ``(n_episodes, n_prey)``."""

    size: int
    """Side of the toroid, in cells."""

    @classmethod
    def of_trace(cls, trace: np.ndarray, n_predators: int, size: int, captured: np.ndarray | None = None) -> Paths:
        """Read a trace, int ``(n_episodes, n_rows, n_agents, 2)``: cells in [0, size), predators first, rows after the
        end of an episode -1.

        A free prey always moves (section V), so one that stands still was caught when it got there; with captures of
        those who trade places, this dates one a step early. An episode that ends before the last row ended because all
        prey were caught. For the last row itself, ``captured``, bool ``(n_episodes, n_prey)``, tells; without it a prey
        in whose cell a predator stands counts as caught, which misses one who ran into a predator that then moved on
        (``move_order="prey_first"``).

        Raises :class:`ValueError` for shapes and cells that do not fit.
        """
        trace = np.asarray(trace)
        if trace.ndim != 4 or trace.shape[3] != 2 or not 0 < n_predators < trace.shape[2] or not trace.shape[1]:
            raise ValueError(
                f"trace must have shape (episodes, rows, agents, 2) with more than {n_predators} agents, "
                f"got {trace.shape}"
            )
        valid = trace[:, :, 0, 0] >= 0
        lengths = valid.sum(axis=1) - 1
        inside = np.where(_until(lengths, trace.shape[1])[..., None, None], (trace >= 0) & (trace < size), trace == -1)
        if not inside.all() or (lengths < 0).any():
            raise ValueError(f"trace must hold cells in [0, {size}) and, after the end of an episode, -1 alone")
        steps = minimal_image(np.diff(trace, axis=1), size) * valid[:, 1:, None, None]
        if (np.abs(steps).sum(axis=-1) > 1).any():
            raise ValueError(f"agents must move at most one cell a step, got {np.abs(steps).sum(axis=-1).max()}")
        cells = np.concatenate([trace[:, :1], trace[:, :1] + np.cumsum(steps, axis=1)], axis=1).astype(np.int32)
        predators, prey = cells[:, :, :n_predators], cells[:, :, n_predators:]
        times = _capture_times(predators, prey, lengths, size, captured)
        return cls(predators, prey, lengths, times, size)

    @property
    def n_episodes(self) -> int:
        """Episodes."""
        return int(self.prey.shape[0])

    @property
    def n_rows(self) -> int:
        """Rows: one more than the most steps of an episode."""
        return int(self.prey.shape[1])

    @property
    def n_predators(self) -> int:
        """Predators in the team."""
        return int(self.predators.shape[2])

    @property
    def n_prey(self) -> int:
        """Prey in the team."""
        return int(self.prey.shape[2])

    @cached_property
    def valid(self) -> np.ndarray:
        """Rows of the episode, bool ``(n_episodes, n_rows)``."""
        return _until(self.lengths, self.n_rows)

    @cached_property
    def alive(self) -> np.ndarray:
        """Rows of the episode at which a prey is not caught, bool ``(n_episodes, n_rows, n_prey)``."""
        return np.asarray(self.valid[:, :, None] & (np.arange(self.n_rows)[:, None] < self.capture_times[:, None, :]))

    @cached_property
    def captured(self) -> np.ndarray:
        """Who was caught, bool ``(n_episodes, n_prey)``."""
        return np.asarray(self.capture_times < self.n_rows)

    @cached_property
    def offsets(self) -> np.ndarray:
        """Where each predator is seen from each prey, the shortest way round, in cells: int32
        ``(n_episodes, n_rows, n_predators, n_prey, 2)``.
        """
        return minimal_image(self.predators[:, :, :, None] - self.prey[:, :, None], self.size)

    @cached_property
    def distances(self) -> np.ndarray:
        """Toroidal Manhattan distances, in steps: int32 ``(n_episodes, n_rows, n_predators, n_prey)``."""
        return np.asarray(np.abs(self.offsets).sum(axis=-1, dtype=np.int32))

    def between_prey(self, one: int, other: int) -> np.ndarray:
        """Where prey ``other`` is seen from prey ``one``, int32 ``(n_episodes, n_rows, 2)``."""
        return minimal_image(self.prey[:, :, other] - self.prey[:, :, one], self.size)

    def reaches(self, back: int = 0, on: int = 0) -> np.ndarray:
        """Rows with ``back`` rows of the episode before them and ``on`` after, bool ``(n_episodes, n_rows)``."""
        rows = np.arange(self.n_rows)
        return np.asarray((rows >= back) & (rows + on <= self.lengths[:, None]))


def _until(last: np.ndarray, n_rows: int) -> np.ndarray:
    return np.asarray(np.arange(n_rows) <= last[:, None])


def _capture_times(
    predators: np.ndarray, prey: np.ndarray, lengths: np.ndarray, size: int, captured: np.ndarray | None
) -> np.ndarray:
    n_episodes, n_rows, n_prey = prey.shape[:3]
    if captured is not None and captured.shape != (n_episodes, n_prey):
        raise ValueError(f"captured must have shape {(n_episodes, n_prey)}, got {captured.shape}")
    moved = (np.diff(prey, axis=1) != 0).any(axis=3)
    stood = ~moved & (np.arange(n_rows - 1) < lengths[:, None])[:, :, None]
    times = np.where(stood.any(axis=1), np.argmax(stood, axis=1), n_rows)
    if captured is None:
        last = np.arange(n_episodes), lengths
        met = minimal_image(predators[last][:, :, None] - prey[last][:, None], size) == 0
        captured = met.all(axis=3).any(axis=1) | (lengths < n_rows - 1)[:, None]
    return np.where((times == n_rows) & captured, lengths[:, None], times)
