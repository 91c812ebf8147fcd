"""Results of a set of episodes, with 95% intervals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from math import sqrt
from typing import Any

from esp_trainer.arrays import Counts, EpisodePayoffs
from esp_trainer.types import TrialResult

Z_95 = 1.959963984540054
"""Half the width of a 95% interval, in standard errors of a normal estimate."""


@dataclass(frozen=True)
class Rate:
    """An estimate with its 95% interval: a proportion (Wilson interval), a mean score, or a rating in points."""

    rate: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.rate:.3f} [{self.low:.3f}, {self.high:.3f}]"


def in_points(rating: Rate) -> str:
    """Return a rating with its interval as text, in whole points."""
    return f"{rating.rate:z.0f} [{rating.low:z.0f}, {rating.high:z.0f}]"


def wilson(successes: int, n: int) -> Rate:
    """Return the fraction of successes among ``n``, with its 95% score interval (Wilson 1927)."""
    return wilson_of(successes / n, n)


def wilson_of(share: float, n: int) -> Rate:
    """Return a fraction of ``n`` with its 95% Wilson interval.

    The fraction need not be a whole number of successes: the fraction of prey caught in ``n`` episodes, for example.
    """
    centre = (share + Z_95**2 / (2 * n)) / (1 + Z_95**2 / n)
    half = Z_95 / (1 + Z_95**2 / n) * sqrt(share * (1 - share) / n + (Z_95 / (2 * n)) ** 2)
    return Rate(share, min(share, max(0.0, centre - half)), max(share, min(1.0, centre + half)))


@dataclass(frozen=True)
class Captures:
    """Results of a predator team against a prey team."""

    episodes: int
    predators_succeed: Rate
    """Fraction of episodes in which all prey were caught."""
    prey_succeed: Rate
    """Fraction of episodes in which no prey was caught."""
    caught: Rate
    """Fraction of prey caught, over all episodes. The prey of one episode are not caught independently, so the interval
    counts each episode as one trial. It is wide enough even if they always share their fate."""
    caught_by_even: list[Rate | None]
    """Fraction of prey caught, by the number of predators that started at an even Manhattan distance from the prey, 0
    to all; None for a number that no prey had."""
    steps: float
    """Mean length of an episode, in time steps."""
    predator_fitness: float
    """Mean fitness over predators and episodes."""
    prey_fitness: float
    """Mean fitness over prey and episodes."""

    @property
    def payoff(self) -> Rate:
        """Payoff of the predators: the fraction of prey caught."""
        return self.caught

    def as_dict(self) -> dict[str, Any]:
        """Return the fields as JSON values."""
        return asdict(self)


@dataclass(frozen=True)
class Payoffs:
    """Results of two teams against each other in another game than the predator-prey world."""

    episodes: int
    payoff: Rate
    """Mean payoff to the first team (:func:`~esp_trainer.types.zero_sum_part`), with its normal interval."""
    steps: float
    """Mean length of an episode, in time steps."""
    predator_fitness: float
    """Mean return over the agents of the first team and episodes."""
    prey_fitness: float
    """Mean return over the agents of the second team and episodes."""

    def as_dict(self) -> dict[str, Any]:
        """Return the fields as JSON values."""
        return asdict(self)


def mean_of(values: EpisodePayoffs) -> Rate:
    """Return a mean with its 95% interval, 1.96 standard errors each way; of one value the interval is the value."""
    mean, n = float(values.mean()), values.size
    half = Z_95 * float(values.std(ddof=1)) / sqrt(n) if n > 1 else 0.0
    return Rate(mean, mean - half, mean + half)


def summarise(result: TrialResult, even: Counts) -> Captures | Payoffs:
    """Summarise a batch: captures in the predator-prey world, payoffs in any other game.

    Args:
        result: Result of the batch.
        even: Number of predators that start at an even distance from each prey, see :func:`count_captures`.
    """
    if result.returned is None:
        return count_captures(result, even, result.fitness.shape[-1] - result.captured.shape[-1])
    return Payoffs(
        episodes=result.steps.size,
        payoff=mean_of(result.returned),
        steps=float(result.steps.mean()),
        predator_fitness=float(result.fitness_of("predators").mean()),
        prey_fitness=float(result.fitness_of("prey").mean()),
    )


def results_in_short(held_out: Mapping[str, Any]) -> str:
    """Return results, as JSON values, in a few words."""
    rates = {name: f"{value['rate']:z.2f}" for name, value in held_out.items() if isinstance(value, Mapping)}
    if "payoff" in rates:
        return f"payoff {rates['payoff']}"
    return f"predators succeed {rates['predators_succeed']}, prey {rates['prey_succeed']}, caught {rates['caught']}"


def count_captures(result: TrialResult, even: Counts, n_predators: int) -> Captures:
    """Summarise a batch.

    Args:
        result: Result of the batch.
        even: Number of predators that start at an even distance from each prey: int, of the shape of
            ``result.captured``.
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
