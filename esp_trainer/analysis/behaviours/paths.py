"""Paths of the agents, unwrapped: a step across the seam of the torus changes a coordinate by 1 like any other step."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from esp_trainer.analysis.behaviours.episode import measure_offsets, unwrap
from esp_trainer.arrays import BoolMask, Cells, Steps
from predprey_env.jit import entry_point
from predprey_env.jit.values import Array


@entry_point
def _unwrap_all(traces: Array, lengths: Array, size: int, cells: Array) -> None:
    for episode in range(len(traces)):
        unwrap(traces[episode], lengths[episode], size, cells[episode])


@entry_point
def _measure_all(traces: Array, n_predators: int, size: int, offsets: Array) -> None:
    for episode in range(len(traces)):
        measure_offsets(traces[episode], n_predators, size, offsets[episode])


@dataclass(frozen=True, eq=False)
class Paths:
    """The paths of all agents in a set of episodes.

    Arrays over time begin with the axes ``(n_episodes, n_rows, ...)``. Row 0 is the start, row ``t`` is after step
    ``t``, and rows after the end of an episode repeat its last row.
    """

    predators: Cells
    """Unwrapped cells (x, y), int64 ``(n_episodes, n_rows, n_predators, 2)``: east is +x, north is +y."""

    prey: Cells
    """Unwrapped cells (x, y), int64 ``(n_episodes, n_rows, n_prey, 2)``."""

    lengths: Steps
    """Index of the last row of each episode, int ``(n_episodes,)``: its number of steps."""

    capture_times: Steps
    """Row at which each prey is caught, or ``n_rows`` if it never is, int ``(n_episodes, n_prey)``."""

    size: int
    """Side of the torus, in cells."""

    detected: dict[Any, Any] = field(default_factory=dict, init=False, repr=False)
    """Behaviours detected in these episodes, by thresholds: see :func:`.detection.detected`."""

    @classmethod
    def of_trace(cls, cells: Cells, n_predators: int, size: int, caught_at: Steps | None = None) -> Paths:
        """Make the paths of episodes from the cells of all agents, as :class:`esp_trainer.types.Trace` records them.

        Args:
            cells: Cells in [0, size), int ``(n_episodes, n_rows, n_agents, 2)``, predators first; -1 after the end of
                an episode.
            n_predators: Number of predators.
            size: Side of the torus, in cells.
            caught_at: Step in which each prey was caught, counted from 1, or 0 if it was not: int ``(n_episodes,
                n_prey)``. Without it, it is inferred from the cells of moves at once: a free prey always moves (section
                V), so one that stands still is caught; at the last row one is caught if a predator is in its cell or
                if the episode ended early.

        Raises:
            ValueError: Shapes or cells do not fit, or an agent moves by more than one cell in a step.
        """
        cells = np.asarray(cells)
        if cells.ndim != 4 or cells.shape[3] != 2 or not 0 < n_predators < cells.shape[2] or not cells.shape[1]:
            raise ValueError(
                f"cells must have shape (episodes, rows, agents, 2) with more than {n_predators} agents, "
                f"got {cells.shape}"
            )
        valid = cells[:, :, 0, 0] >= 0
        lengths = valid.sum(axis=1) - 1
        inside = np.where(_until(lengths, cells.shape[1])[..., None, None], (cells >= 0) & (cells < size), cells == -1)
        if not inside.all() or (lengths < 0).any():
            raise ValueError(f"cells must hold cells in [0, {size}) and, after the end of an episode, -1 alone")
        path = np.empty(cells.shape, np.int64)
        _unwrap_all(np.ascontiguousarray(cells, np.int64), lengths, size, path)
        steps = np.abs(np.diff(path, axis=1)).sum(axis=-1)
        if (steps > 1).any():
            raise ValueError(f"agents must move at most one cell a step, got {steps.max()}")
        predators, prey = path[:, :, :n_predators], path[:, :, n_predators:]
        if caught_at is None:
            times = _inferred(predators, prey, lengths, size)
        elif caught_at.shape != (len(prey), prey.shape[2]):
            raise ValueError(f"caught_at must have shape {(len(prey), prey.shape[2])}, got {caught_at.shape}")
        else:
            times = np.where(caught_at > 0, caught_at, prey.shape[1])
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
    def valid(self) -> BoolMask:
        """True at rows up to the end of the episode, bool ``(n_episodes, n_rows)``."""
        return _until(self.lengths, self.n_rows)

    @cached_property
    def captured(self) -> BoolMask:
        """True for prey that are caught in the episode, bool ``(n_episodes, n_prey)``."""
        return self.capture_times < self.n_rows

    @cached_property
    def cells(self) -> Cells:
        """Unwrapped cells of all agents, predators first, int64 ``(n_episodes, n_rows, n_agents, 2)``."""
        return np.concatenate([self.predators, self.prey], axis=2, dtype=np.int64)

    @cached_property
    def all_offsets(self) -> np.ndarray:
        """Displacement from each prey to each agent, in cells, the shortest way round: int64
        ``(n_episodes, n_rows, n_agents, n_prey, 2)``.
        """
        offsets = np.empty((*self.cells.shape[:3], self.n_prey, 2), np.int64)
        _measure_all(self.cells % self.size, self.n_predators, self.size, offsets)
        return offsets

    @property
    def offsets(self) -> np.ndarray:
        """Displacement from each prey to each predator, in cells, the shortest way round: int64
        ``(n_episodes, n_rows, n_predators, n_prey, 2)``.
        """
        return self.all_offsets[:, :, : self.n_predators]

    @cached_property
    def distances(self) -> np.ndarray:
        """Toroidal Manhattan distances, in steps, int32 ``(n_episodes, n_rows, n_predators, n_prey)``."""
        return np.abs(self.offsets).sum(axis=-1, dtype=np.int32)


def _until(last: Steps, n_rows: int) -> BoolMask:
    return np.arange(n_rows) <= last[:, None]


def _inferred(predators: Cells, prey: Cells, lengths: Steps, size: int) -> Steps:
    """Return capture times that follow from the paths alone."""
    n_episodes, n_rows = prey.shape[:2]
    moved = (np.diff(prey, axis=1) != 0).any(axis=3)
    stood = ~moved & (np.arange(n_rows - 1) < lengths[:, None])[:, :, None]
    times = np.where(stood.any(axis=1), np.argmax(stood, axis=1), n_rows)
    last = np.arange(n_episodes), lengths
    met = (predators[last][:, :, None] - prey[last][:, None]) % size == 0
    captured = met.all(axis=3).any(axis=1) | (lengths < n_rows - 1)[:, None]
    return np.where((times == n_rows) & captured, lengths[:, None], times)
