"""Looking back and on along the rows (axis 1) of arrays ``(n_episodes, n_rows, ...)``.

What lies outside the array is made up: who looks further than the episode goes must ask :meth:`Paths.reaches`.
"""

from __future__ import annotations

import numpy as np


def steps(cells: np.ndarray) -> np.ndarray:
    """The step that led to each row; to row 0 none did, and it is 0."""
    return np.diff(cells, axis=1, prepend=cells[:, :1])


def ago(values: np.ndarray, rows: int) -> np.ndarray:
    """What was ``rows`` rows earlier."""
    return np.roll(values, rows, axis=1)


def ahead(values: np.ndarray, rows: int) -> np.ndarray:
    """What will be ``rows`` rows later."""
    return np.roll(values, -rows, axis=1)


def total(values: np.ndarray, rows: int) -> np.ndarray:
    """The sum over each row and those before it, ``rows`` in all; bools are counted."""
    sums = np.cumsum(values, axis=1, dtype=np.int32)
    earlier = np.zeros_like(sums)
    earlier[:, rows:] = sums[:, : max(0, sums.shape[1] - rows)]
    return sums - earlier


def extent(cells: np.ndarray, rows: int) -> np.ndarray:
    """The longer side of the box that holds a path over each row and the ``rows`` before it, in steps: of ``(..., 2)``
    cells int ``(...)``.
    """
    low, high, reached = cells, cells, 0
    while reached < rows:
        jump = min(reached + 1, rows - reached)
        low, high = np.minimum(low, ago(low, jump)), np.maximum(high, ago(high, jump))
        reached += jump
    return np.asarray((high - low).max(axis=-1))


def spread_back(found: np.ndarray, rows: int) -> np.ndarray:
    """Mark also the ``rows`` rows before each marked one."""
    spread, reached = found.copy(), 0
    while reached < min(rows, found.shape[1] - 1):
        jump = min(reached + 1, rows - reached)
        spread[:, :-jump] |= spread[:, jump:].copy()
        reached += jump
    return spread


def dot(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Scalar product over the last axis."""
    return np.asarray(one[..., 0] * other[..., 0] + one[..., 1] * other[..., 1])


def cross(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Positive where ``other`` lies to the left of ``one``."""
    return np.asarray(one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0])


def cosine(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Of the angle between two vectors of the last axis; 1 where one of them is 0."""
    one, other = one.astype(float), other.astype(float)  # squares of squares do not fit into 32 bits
    lengths = np.sqrt(dot(one, one) * dot(other, other))
    return np.where(lengths > 0, dot(one, other) / np.maximum(lengths, 1), 1.0)
