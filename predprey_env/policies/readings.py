"""Features that scripts read from an observation: the nearest opponent, and the move towards a place."""

from __future__ import annotations

from predprey_env.jit.compilation import rule
from predprey_env.jit.lanes import load, where
from predprey_env.jit.values import FloatRows, Value
from predprey_env.rules.torus import magnitude, manhattan

FAR = 1 << 20
"""Distance of a caught opponent, longer than any way on a torus."""


@rule
def nearest(seen: FloatRows, n_opponents: int) -> Value:
    """Return the offset ``(dx, dy)`` of the nearest opponent, and its distance; caught opponents, at (0, 0), are
    skipped.
    """
    nearest_x, nearest_y = load(seen, 0), load(seen, 1)
    length = manhattan(nearest_x, nearest_y)
    shortest = where(length == 0, length + FAR, length)
    for opponent in range(1, n_opponents):
        dx, dy = load(seen, 2 * opponent), load(seen, 2 * opponent + 1)
        length = manhattan(dx, dy)
        closer = (length < shortest) & (length > 0)
        nearest_x, nearest_y = where(closer, dx, nearest_x), where(closer, dy, nearest_y)
        shortest = where(closer, length, shortest)
    return nearest_x, nearest_y, shortest


@rule
def towards(dx: Value, dy: Value) -> Value:
    """Return the move that shortens the longer leg of an offset; the x leg if both are equally long."""
    return where(magnitude(dx) >= magnitude(dy), where(dx > 0, 0, 1), where(dy > 0, 2, 3))
