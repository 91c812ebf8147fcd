"""Pools of opponents, from which each episode samples one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from predprey_env.policies.opponents import Opponent
from predprey_env.settings import brief


class OpponentPool:
    """A pool of opponents, from which each episode samples one, for self-play and leagues.

    Args:
        opponents: The opponents: names of scripts, policies or functions.
        weights: Weight of each opponent, at least 0; an opponent's probability is its weight over the sum of all
            weights. By default all weights are equal.
    """

    def __init__(self, opponents: Sequence[Opponent], weights: Sequence[float] | None = None) -> None:
        self.opponents = tuple(opponents)
        if not self.opponents:
            raise ValueError("a pool needs at least one opponent, got none")
        given = np.ones(len(self.opponents)) if weights is None else _numbers(weights)
        if given.shape != (len(self.opponents),):
            raise ValueError(
                f"weights must be {len(self.opponents)} numbers, one for each opponent, got {brief(weights)}"
            )
        if not (np.isfinite(given).all() and given.min() >= 0 and given.max() > 0):
            raise ValueError(f"weights must be finite, at least 0 and not all 0, got {brief(weights)}")
        self._ends = np.cumsum(given / given.max())

    def __len__(self) -> int:
        """Return the number of opponents."""
        return len(self.opponents)

    def sample(self, generator: np.random.Generator) -> int:
        """Return the index of a random opponent. A pool of one leaves the generator unchanged."""
        if len(self) == 1:
            return 0
        # The product may round up to the sum of all weights, which lies past the last opponent.
        point = min(generator.random() * self._ends[-1], np.nextafter(self._ends[-1], 0))
        return int(np.searchsorted(self._ends, point, side="right"))


Opponents: TypeAlias = Opponent | OpponentPool | Sequence[Opponent]
"""An opponent, or a pool of them; a list is a pool with equal weights."""


def as_pool(opponents: Opponents) -> OpponentPool:
    """Return opponents as a pool: a pool itself, a list with equal weights, or a pool of one."""
    if isinstance(opponents, OpponentPool):
        return opponents
    return OpponentPool(opponents if isinstance(opponents, list | tuple) else [opponents])  # type: ignore[list-item]


def _numbers(weights: object) -> np.ndarray:
    try:
        return np.asarray(weights, np.float64)
    except (TypeError, ValueError):
        raise ValueError(f"weights must be numbers, got {brief(weights)}") from None
