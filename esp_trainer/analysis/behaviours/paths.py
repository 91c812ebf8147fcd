"""Paths of the agents, unwrapped: a step across the seam of the torus changes a coordinate by 1 like any other step."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np


def minimal_image(way: np.ndarray, size: int) -> np.ndarray:
    """Return displacements along an axis, in cells, taken the shortest way round the torus.

    They lie in ``[-(size // 2), size - size // 2 - 1]``, as those of :func:`predprey_env.torus.displacement`.
    """
    half = size // 2
    return np.asarray((way + half) % size - half)


@dataclass(frozen=True, eq=False)
class Paths:
    """The paths of all agents in a set of episodes.

    Arrays over time begin with the axes ``(n_episodes, n_rows, ...)``. Row 0 is the start, row ``t`` is after step
    ``t``, and rows after the end of an episode repeat its last row.
    """

    predators: np.ndarray
    """Unwrapped cells (x, y), int32 ``(n_episodes, n_rows, n_predators, 2)``: east is +x, north is +y."""

    prey: np.ndarray
    """Unwrapped cells (x, y), int32 ``(n_episodes, n_rows, n_prey, 2)``."""

    lengths: np.ndarray
    """Index of the last row of each episode, int ``(n_episodes,)``: its number of steps."""

    capture_times: np.ndarray
    """Row at which each prey is caught, or ``n_rows`` if it never is, int ``(n_episodes, n_prey)``."""

    size: int
    """Side of the torus, in cells."""

    @classmethod
    def of_trace(cls, trace: np.ndarray, n_predators: int, size: int, captured: np.ndarray | None = None) -> Paths:
        """Read the paths and capture times from a trace.

        A free prey always moves (section V), so a prey that stands still was caught when it reached its cell. If agents
        that trade places are caught, this dates a capture one step early. An episode that ends before the last row
        ended because all prey were caught.

        Args:
            trace: Cells in [0, size), int ``(n_episodes, n_rows, n_agents, 2)``, predators first; -1 after the end of
                an episode.
            n_predators: Number of predators.
            size: Side of the torus, in cells.
            captured: Prey caught by the end, bool ``(n_episodes, n_prey)``, which decides about captures at the last
                row. Without it, a prey counts as caught there if a predator is in its cell. This misses prey that ran
                into a predator that then moved on (``move_order="prey_first"``).

        Raises:
            ValueError: Shapes or cells do not fit, or an agent moves by more than one cell in a step.
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
        """Number of episodes."""
        return int(self.prey.shape[0])

    @property
    def n_rows(self) -> int:
        """Number of rows: one more than the maximum number of steps of an episode."""
        return int(self.prey.shape[1])

    @property
    def n_predators(self) -> int:
        """Number of predators in the team."""
        return int(self.predators.shape[2])

    @property
    def n_prey(self) -> int:
        """Number of prey in the team."""
        return int(self.prey.shape[2])

    @cached_property
    def valid(self) -> np.ndarray:
        """True at rows up to the end of the episode, bool ``(n_episodes, n_rows)``."""
        return _until(self.lengths, self.n_rows)

    @cached_property
    def alive(self) -> np.ndarray:
        """True at rows of the episode at which the prey is not yet caught, bool ``(n_episodes, n_rows, n_prey)``."""
        return np.asarray(self.valid[:, :, None] & (np.arange(self.n_rows)[:, None] < self.capture_times[:, None, :]))

    @cached_property
    def captured(self) -> np.ndarray:
        """True for prey that are caught in the episode, bool ``(n_episodes, n_prey)``."""
        return np.asarray(self.capture_times < self.n_rows)

    @cached_property
    def offsets(self) -> np.ndarray:
        """Displacement from each prey to each predator, in cells, the shortest way round: int32
        ``(n_episodes, n_rows, n_predators, n_prey, 2)``.
        """
        return minimal_image(self.predators[:, :, :, None] - self.prey[:, :, None], self.size)

    @cached_property
    def distances(self) -> np.ndarray:
        """Toroidal Manhattan distances, in steps, int32 ``(n_episodes, n_rows, n_predators, n_prey)``."""
        return np.asarray(np.abs(self.offsets).sum(axis=-1, dtype=np.int32))

    def between_prey(self, one: int, other: int) -> np.ndarray:
        """Return the displacement from prey ``one`` to prey ``other``, in cells, int32 ``(n_episodes, n_rows, 2)``."""
        return minimal_image(self.prey[:, :, other] - self.prey[:, :, one], self.size)

    def reaches(self, back: int = 0, on: int = 0) -> np.ndarray:
        """Return at which rows the episode has ``back`` rows before and ``on`` rows after, bool
        ``(n_episodes, n_rows)``.
        """
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
