"""The course of an episode, as a viewer has seen it."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

import numpy as np

from predprey_env.arrays import Places
from predprey_env.rules.dynamics import World


class Stretch(NamedTuple):
    """The moves of all agents between two successive moments that were seen: in a time step, or half of one."""

    time: float
    """Time of the second moment, in steps."""

    start: Places
    """Cells of the agents at the first moment: int32 ``(n_agents, 2)``, columns and rows."""

    way: Places
    """Move of each agent: -1, 0 or 1 cells along each axis, int32 ``(n_agents, 2)``."""


class Track:
    """Moves and capture times of one episode, at the moments that a viewer has seen.

    An agent moves one cell a step. Between moments further apart its path is unknown, and it leaves no trail.
    """

    def __init__(self, world: World, time: float, size: int, length: float) -> None:
        """Start with the world at a time, in steps; moves older than ``length`` steps are dropped."""
        self.time = time
        self.cells = _cells(world)
        """Cells of the agents at the last moment: int32 ``(n_agents, 2)``."""
        self.way = np.zeros_like(self.cells)
        """Moves since the previous moment, zero if they are unknown: int32 ``(n_agents, 2)``."""
        self.heading = np.zeros_like(self.cells)
        """Last move of each agent that changed its cell: int32 ``(n_agents, 2)``."""
        self.duration = 0.0
        """Steps since the previous moment, 0 if the moves are unknown."""
        self.caught_at = np.where(world.alive, np.inf, time)
        """Time at which each prey was first seen to be caught, in steps, infinite while it is free: ``(n_prey,)``."""
        self.stretches: deque[Stretch] = deque()
        """Recent moves, oldest first."""
        self._size = size
        self.length = length

    def see(self, world: World, time: float) -> bool:
        """Add the world at a time that is not earlier than the last. Return whether the time is new."""
        if time == self.time:
            return False
        cells, duration = _cells(world), time - self.time
        known = duration <= 1
        half = self._size // 2
        way = (cells - self.cells + half) % self._size - half if known else np.zeros_like(cells)
        if known:
            self.stretches.append(Stretch(time, self.cells, way))
        while self.stretches and self.stretches[0].time <= time - self.length:
            self.stretches.popleft()
        self.heading = np.where(way.any(axis=1, keepdims=True), way, self.heading) if known else way
        self.cells, self.way, self.time, self.duration = cells, way, time, duration if known else 0.0
        self.caught_at[(world.alive == 0) & np.isinf(self.caught_at)] = time
        return True


def _cells(world: World) -> Places:
    return np.stack([world.x, world.y], axis=1)
