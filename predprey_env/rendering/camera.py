"""A camera that follows the chase, so that the chase never jumps across the edge of the picture."""

from __future__ import annotations

import numpy as np

from predprey_env.arrays import Places
from predprey_env.rules.dynamics import World

_EASE = 0.15
"""Fraction of the way to the chase that the camera moves in a time step: quick enough to keep up, without jolts."""


class Camera:
    """The point of the torus in the middle of the picture: the free prey that is nearest to a predator, smoothed.

    When all prey are caught, the camera stays where it is.
    """

    def __init__(self, size: int) -> None:
        self._size = size
        self._centre: Places | None = None
        self._time = 0.0

    def look(self, world: World, time: float) -> Places:
        """Return the centre of the picture at a time in steps, which must not decrease between calls: float64 ``(2,)``,
        column and row in cells.
        """
        target = self._target(world)
        if self._centre is None:
            self._centre = np.full(2, self._size / 2) if target is None else target
        elif target is not None:
            way = (target - self._centre + self._size / 2) % self._size - self._size / 2
            self._centre = (self._centre + (1 - (1 - _EASE) ** (time - self._time)) * way) % self._size
        self._time = time
        return self._centre

    def _target(self, world: World) -> Places | None:
        """Return the middle of the cell of the free prey that is nearest to a predator; None if none is free."""
        cells = np.stack([world.x, world.y], axis=1).astype(float)
        n_predators = len(cells) - len(world.alive)
        free = cells[n_predators:][world.alive != 0]
        if not len(free):
            return None
        apart = np.abs(free[:, None] - cells[:n_predators])
        distances = np.minimum(apart, self._size - apart).sum(axis=2).min(axis=1)
        return free[distances.argmin()] + 0.5
