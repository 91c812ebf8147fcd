"""Operations along the rows (axis 1) of arrays ``(n_episodes, n_rows, ...)``, and products of vectors.

Rows beyond either end of an array are not valid: a caller that looks back or ahead beyond the episode must mask the
result with :meth:`Paths.reaches`.
"""

from __future__ import annotations

import numpy as np


def steps(cells: np.ndarray) -> np.ndarray:
    """Return the step that led to each row; 0 for row 0."""
    return np.diff(cells, axis=1, prepend=cells[:, :1])


def ago(values: np.ndarray, rows: int) -> np.ndarray:
    """Return the values ``rows`` rows earlier; the first ``rows`` rows wrap around and are not valid."""
    return np.roll(values, rows, axis=1)


def ahead(values: np.ndarray, rows: int) -> np.ndarray:
    """Return the values ``rows`` rows later; the last ``rows`` rows wrap around and are not valid."""
    return np.roll(values, -rows, axis=1)


def total(values: np.ndarray, rows: int) -> np.ndarray:
    """Return the sum over each row and the rows before it, ``rows`` rows in all; bools are counted."""
    sums = np.cumsum(values, axis=1, dtype=np.int32)
    earlier = np.zeros_like(sums)
    earlier[:, rows:] = sums[:, : max(0, sums.shape[1] - rows)]
    return sums - earlier


def extent(cells: np.ndarray, rows: int) -> np.ndarray:
    """Return the longer side, in steps, of the box that holds a path over each row and the ``rows`` rows before it.

    Cells ``(..., 2)`` give int ``(...)``.
    """
    low, high, reached = cells, cells, 0
    # The window doubles in each pass, so this takes log2(rows) passes rather than rows.
    while reached < rows:
        jump = min(reached + 1, rows - reached)
        low, high = np.minimum(low, ago(low, jump)), np.maximum(high, ago(high, jump))
        reached += jump
    return np.asarray((high - low).max(axis=-1))


def spread_back(found: np.ndarray, rows: int) -> np.ndarray:
    """Return ``found`` with the ``rows`` rows before each marked row marked as well."""
    spread, reached = found.copy(), 0
    while reached < min(rows, found.shape[1] - 1):
        jump = min(reached + 1, rows - reached)
        spread[:, :-jump] |= spread[:, jump:].copy()
        reached += jump
    return spread


def dot(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the scalar product over the last axis."""
    return np.asarray(one[..., 0] * other[..., 0] + one[..., 1] * other[..., 1])


def cross(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the cross product over the last axis: positive where ``other`` points to the left of ``one``."""
    return np.asarray(one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0])


def cosine(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the cosine of the angle between two vectors along the last axis; 1 where one of them is 0."""
    one, other = one.astype(float), other.astype(float)  # products of squared lengths do not fit into 32 bits
    lengths = np.sqrt(dot(one, one) * dot(other, other))
    return np.where(lengths > 0, dot(one, other) / np.maximum(lengths, 1), 1.0)
