"""What a set of episodes says, with intervals."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from math import sqrt
from typing import Any

import numpy as np

from esp_trainer.types import TrialResult

_Z_95 = 1.959963984540054


@dataclass(frozen=True)
class Rate:
    """A share with its 95% Wilson interval."""

    rate: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.rate:.3f} [{self.low:.3f}, {self.high:.3f}]"


def in_points(rating: Rate) -> str:
    """A rating with its interval, in whole points."""
    return f"{rating.rate:z.0f} [{rating.low:z.0f}, {rating.high:z.0f}]"


def wilson(successes: int, n: int) -> Rate:
    """The share of successes among ``n`` and its 95% score interval (Wilson 1927)."""
    return wilson_of(successes / n, n)


def wilson_of(share: float, n: int) -> Rate:
    """The same of a share that need not be a whole number of ``n``, such as that of prey in ``n`` episodes."""
    centre = (share + _Z_95**2 / (2 * n)) / (1 + _Z_95**2 / n)
    half = _Z_95 / (1 + _Z_95**2 / n) * sqrt(share * (1 - share) / n + (_Z_95 / (2 * n)) ** 2)
    return Rate(share, min(share, max(0.0, centre - half)), max(share, min(1.0, centre + half)))


@dataclass(frozen=True)
class Captures:
    """How a predator team and a prey team did against each other."""

    episodes: int
    predators_succeed: Rate
    """All prey caught."""
    prey_succeed: Rate
    """No prey caught."""
    caught: Rate
    """Prey caught, of all prey of all episodes. As those of one episode are not caught independently, the interval is
    that of as many trials as there are episodes: wide enough even if they always share their fate."""
    caught_by_even: list[Rate | None]
    """The same by how many predators started at an even Manhattan distance from the prey, 0 to all; None where no prey
    did."""
    steps: float
    """Mean length of an episode."""
    predator_fitness: float
    """Mean over predators and episodes."""
    prey_fitness: float
    """Mean over prey and episodes."""

    def as_dict(self) -> dict[str, Any]:
        """JSON values."""
        return asdict(self)


def count_captures(result: TrialResult, even: np.ndarray, n_predators: int) -> Captures:
    """Summarise a batch.

    Args:
        result: What came of it.
        even: For each prey, how many predators started at an even distance: int, of the shape of ``result.captured``.
        n_predators: Predators in the team.
    """
    captured = result.captured.reshape(-1, result.captured.shape[-1])
    strata = [even.reshape(captured.shape) == k for k in range(n_predators + 1)]
    by_even = [wilson_of(float(captured[s].mean()), int(s.any(axis=1).sum())) if s.any() else None for s in strata]
    return Captures(
        episodes=len(captured),
        predators_succeed=wilson(int(captured.all(axis=1).sum()), len(captured)),
        prey_succeed=wilson(int((~captured.any(axis=1)).sum()), len(captured)),
        caught=wilson_of(float(captured.mean()), len(captured)),
        caught_by_even=by_even,
        steps=float(result.steps.mean()),
        predator_fitness=float(result.fitness_of("predators").mean()),
        prey_fitness=float(result.fitness_of("prey").mean()),
    )
