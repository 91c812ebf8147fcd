"""Predators and prey of all generations on one scale of strength."""

from __future__ import annotations

from dataclasses import dataclass
from math import log

import choix
import numpy as np

from esp_trainer.analysis.games import Sides, as_shares

_POINTS_PER_NAT = 400 / log(10)
_Z_95 = 1.959963984540054
_MAX_ITERATIONS = 10_000  # a perfect ladder of 45 generations takes some hundreds, most matrices about ten


@dataclass(frozen=True)
class Ratings:
    """Ratings of one side's generations with their 95% intervals, float64 ``(G,)`` each."""

    rating: np.ndarray
    low: np.ndarray
    high: np.ndarray


def rate(
    caught: np.ndarray, episodes: int | np.ndarray, generator: np.random.Generator, n_resamples: int = 200
) -> Sides[Ratings]:
    """Ratings by the Bradley-Terry model (Biometrika 39, 1952), in which a predator team with rating ``r`` catches a
    share of ``1 / (1 + 10^((s - r) / 400))`` of prey with rating ``s``: 400 points are ten to one, as in chess.

    The mean of all ratings of both sides is 0, so only differences mean something, those between the sides too. Each
    pair counts as if it had played one more, drawn, episode: this keeps ratings finite where a team always or never
    wins, and costs next to nothing among hundreds of episodes. The interval is 1.96 standard deviations to both sides,
    of ratings from episodes that are drawn anew by each pair's share (parametric bootstrap); it knows of the luck in
    these episodes, not of cycles, which a single number can't show (see
    :func:`~esp_trainer.analysis.games.decompose`).

    Args:
        caught: ``(G, H)``, see :func:`~esp_trainer.analysis.games.as_shares`.
        episodes: Independent episodes behind each share: one number, or int ``(G, H)``.
        generator: Draws the resamples.
        n_resamples: How many; 200 give a standard deviation to some 5%.
    """
    caught = as_shares(caught)
    if np.min(episodes) < 1 or n_resamples < 2:
        raise ValueError(f"episodes must be at least 1 and n_resamples 2, got {episodes} and {n_resamples}")
    fitted = _fit(caught, episodes)
    shares = _with_a_draw(caught, episodes)
    resampled = [_fit(generator.binomial(episodes, shares) / episodes, episodes, fitted) for _ in range(n_resamples)]
    half = _Z_95 * np.std(resampled, axis=0, ddof=1)
    points = [_POINTS_PER_NAT * strengths for strengths in (fitted, fitted - half, fitted + half)]
    n_predators = len(caught)
    return Sides(Ratings(*(p[:n_predators] for p in points)), Ratings(*(p[n_predators:] for p in points)))


def _with_a_draw(caught: np.ndarray, episodes: int | np.ndarray) -> np.ndarray:
    return (caught * episodes + 0.5) / (episodes + 1)


def _fit(caught: np.ndarray, episodes: int | np.ndarray, initial: np.ndarray | None = None) -> np.ndarray:
    """Log-strengths of predators, then prey, mean 0, by maximum likelihood."""
    # choix, not evalica: it takes the matrix of counts and no pandas, and says so when it has not converged.
    n_predators, n = len(caught), sum(caught.shape)
    wins = np.zeros((n, n))
    shares = _with_a_draw(caught, episodes)
    wins[:n_predators, n_predators:] = (episodes + 1) * shares
    wins[n_predators:, :n_predators] = ((episodes + 1) * (1 - shares)).T
    strengths = choix.ilsr_pairwise_dense(wins, initial_params=initial, max_iter=_MAX_ITERATIONS)
    return np.asarray(strengths - strengths.mean())
