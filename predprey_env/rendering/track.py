"""What a viewer has seen of an episode."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

import numpy as np

from predprey_env.rules.dynamics import World


class Stretch(NamedTuple):
    """A time step, or half of one, from one moment that was seen to the next."""

    time: float
    """When it ended, in steps."""

    start: np.ndarray
    """The cells in which it began: int32 ``(n_agents, 2)``, columns and rows."""

    way: np.ndarray
    """Where each agent went: -1, 0 or 1 cells along each axis, int32 ``(n_agents, 2)``."""


class Track:
    """Where the agents of one episode went, and when prey were caught, as far as a viewer looked.

    An agent moves one cell a step. Between moments further apart nobody knows its way: there it leaves no trail.
    """

    def __init__(self, world: World, time: float, size: int, length: float) -> None:
        """Begin with what there is to see at a time, in steps; forget what is older than ``length`` steps."""
        self.time = time
        self.cells = _cells(world)
        """int32 ``(n_agents, 2)``."""
        self.way = np.zeros_like(self.cells)
        """The way from the moment before, zero where nobody knows it: int32 ``(n_agents, 2)``."""
        self.heading = np.zeros_like(self.cells)
        """The last move that was one: int32 ``(n_agents, 2)``."""
        self.duration = 0.0
        """Steps since the moment before, 0 if nobody knows the way from there."""
        self.caught_at = np.where(world.alive, np.inf, time)
        """When each prey was seen to be caught, in steps, infinite while it is free: ``(n_prey,)``."""
        self.stretches: deque[Stretch] = deque()
        """What is not yet forgotten, oldest first."""
        self._size = size
        self.length = length

    def see(self, world: World, time: float) -> bool:
        """Look at the world at a time that is not earlier; whether there was anything new."""
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


def _cells(world: World) -> np.ndarray:
    return np.stack([world.x, world.y], axis=1)
