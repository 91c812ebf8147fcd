"""Ratings that place predators and prey of all generations on one scale of strength."""

from __future__ import annotations

from dataclasses import dataclass
from math import log

import choix
import numpy as np

from esp_trainer.analysis.games import Sides, as_shares
from esp_trainer.arrays import Counts, Curve, PayoffMatrix
from esp_trainer.statistics import Z_95

_POINTS_PER_NAT = 400 / log(10)
_MAX_ITERATIONS = 10_000  # a perfect ranking of 45 generations takes some hundreds, most matrices about ten


@dataclass(frozen=True)
class Ratings:
    """Ratings of one side's generations with their 95% intervals, float64 ``(G,)`` each."""

    rating: Curve
    low: Curve
    high: Curve


def rate(
    caught: PayoffMatrix, episodes: int | Counts, generator: np.random.Generator, n_resamples: int = 200
) -> Sides[Ratings]:
    """Fit ratings by the Bradley-Terry model (Biometrika 39, 1952).

    A predator team with rating ``r`` catches a fraction ``1 / (1 + 10^((s - r) / 400))`` of prey with rating ``s``: 400
    points are odds of ten to one, as in chess. The mean rating of both sides together is 0, so only differences have a
    meaning, including those between the sides.

    Each pair counts as if it had played one more episode that ended in a draw. This keeps ratings finite where a team
    always or never wins, and hardly changes them with hundreds of episodes.

    The interval is the rating plus or minus 1.96 standard deviations of ratings from resampled episodes (parametric
    bootstrap with each pair's fraction). It covers the sampling noise of the episodes, but not cycles, which a single
    number cannot show (see :func:`~esp_trainer.analysis.games.decompose`).

    Args:
        caught: Fraction of prey caught, ``(G, H)``, see :func:`~esp_trainer.analysis.games.as_shares`.
        episodes: Number of independent episodes behind each fraction: one number, or int ``(G, H)``.
        generator: Random generator of the resamples.
        n_resamples: Number of resamples; 200 give the standard deviation to about 5%.
    """
    caught = as_shares(caught)
    if np.min(episodes) < 1 or n_resamples < 2:
        raise ValueError(f"episodes must be at least 1 and n_resamples 2, got {episodes} and {n_resamples}")
    fitted = _fit(caught, episodes)
    shares = _with_a_draw(caught, episodes)
    resampled = [_fit(generator.binomial(episodes, shares) / episodes, episodes, fitted) for _ in range(n_resamples)]
    half = Z_95 * np.std(resampled, axis=0, ddof=1)
    points = [_POINTS_PER_NAT * strengths for strengths in (fitted, fitted - half, fitted + half)]
    n_predators = len(caught)
    return Sides(Ratings(*(p[:n_predators] for p in points)), Ratings(*(p[n_predators:] for p in points)))


def _with_a_draw(caught: PayoffMatrix, episodes: int | Counts) -> PayoffMatrix:
    return (caught * episodes + 0.5) / (episodes + 1)


def _fit(caught: PayoffMatrix, episodes: int | Counts, initial: np.ndarray | None = None) -> np.ndarray:
    """Return the maximum-likelihood log-strengths of predators, then prey, with mean 0."""
    # choix rather than evalica: it takes a matrix of counts, needs no pandas, and reports when it has not converged.
    n_predators, n = len(caught), sum(caught.shape)
    wins = np.zeros((n, n))
    shares = _with_a_draw(caught, episodes)
    wins[:n_predators, n_predators:] = (episodes + 1) * shares
    wins[n_predators:, :n_predators] = ((episodes + 1) * (1 - shares)).T
    strengths = choix.ilsr_pairwise_dense(wins, initial_params=initial, max_iter=_MAX_ITERATIONS)
    return strengths - strengths.mean()
