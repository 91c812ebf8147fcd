"""Geometry of the torus: positions wrap around, and distances take the shorter way."""

from __future__ import annotations

from predprey_env.jit.compilation import rule
from predprey_env.jit.lanes import where
from predprey_env.jit.values import Value


@rule
def wrap(coordinate: Value, size: int) -> Value:
    """Bring a coordinate from [-size, 2 * size) back into [0, size), in cells."""
    coordinate = where(coordinate < 0, coordinate + size, coordinate)
    return where(coordinate >= size, coordinate - size, coordinate)


@rule
def displacement(start: Value, end: Value, size: int) -> Value:
    """Return the signed shortest way along one axis, in cells, in ``[-(size // 2), size - size // 2 - 1]``.

    On a torus of even size the two ways to the antipode have the same length; the negative one is returned.
    """
    half = size // 2
    way = end - start
    way = where(way < -half, way + size, way)
    return where(way >= size - half, way - size, way)


@rule
def magnitude(a: Value) -> Value:
    """Return the absolute value of a number."""
    return where(a < 0, 0 - a, a)


@rule
def manhattan(dx: Value, dy: Value) -> Value:
    """Return the length of a displacement, in steps."""
    return magnitude(dx) + magnitude(dy)


@rule
def largest_distance(size: int) -> int:
    """Return the largest toroidal Manhattan distance between two cells."""
    return 2 * (size // 2)
