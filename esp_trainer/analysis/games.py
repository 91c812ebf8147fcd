"""The empirical game between the generations of a run: its equilibrium, exploitability, and transitive part."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, Literal, NamedTuple, TypeAlias, TypeVar

import numpy as np
from scipy.optimize import linprog
from scipy.special import logit

from esp_trainer.arrays import Curve, MixedStrategy, PayoffMatrix, PayoffVariance

T = TypeVar("T")
PayoffScale: TypeAlias = Literal["shares", "log-odds"]
Noise: TypeAlias = int | PayoffVariance | None
"""Sampling noise of a matrix: the number of independent episodes behind each fraction, the variance of each entry,
``(G, H)``, or None for exact entries."""


class Sides(NamedTuple, Generic[T]):
    """A pair of values, one for each side."""

    predators: T
    prey: T


def as_shares(values: PayoffMatrix, name: str = "caught") -> PayoffMatrix:
    """Check a matrix of fractions of prey caught, and return it as float64.

    Args:
        values: Fraction of the prey of generation ``h`` that the predators of generation ``g`` catch, ``(G, H)``,
            oldest first.
        name: Name of the matrix in error messages.

    Raises:
        ValueError: ``values`` is not a matrix, is empty, or has an entry outside [0, 1].
    """
    shares = np.asarray(values, np.float64)
    if shares.ndim != 2 or not shares.size:
        raise ValueError(f"{name} must have shape (G, H), got {shares.shape}")
    if not ((shares >= 0) & (shares <= 1)).all():  # also rejects nan
        raise ValueError(f"{name} must lie in [0, 1], got {shares.min()} to {shares.max()}")
    return shares


def as_results(values: PayoffMatrix, name: str = "payoffs", total: float = 1.0) -> PayoffMatrix:
    """Check a matrix of results in a constant-sum game, and return it as float64.

    Args:
        values: Results, ``(G, H)``, oldest first.
        name: Name of the matrix in error messages.
        total: Sum of both sides' results: 1 for fractions of prey caught, 0 for the payoffs of any other game.

    Raises:
        ValueError: ``values`` is not a matrix, is empty, or has an entry that is not finite or, with a total of 1,
            outside [0, 1].
    """
    if total == 1.0:
        return as_shares(values, name)
    payoffs = np.asarray(values, np.float64)
    if payoffs.ndim != 2 or not payoffs.size or not np.isfinite(payoffs).all():
        raise ValueError(f"{name} must hold finite numbers, (G, H), got shape {payoffs.shape}")
    return payoffs


def share_variance(shares: PayoffMatrix, episodes: int) -> PayoffVariance:
    """Return unbiased estimates of the variance of fractions over ``episodes`` episodes; nan for one episode."""
    return shares * (1 - shares) / (episodes - 1) if episodes > 1 else np.full_like(shares, np.nan)


def as_square(caught: PayoffMatrix, total: float = 1.0) -> PayoffMatrix:
    """Check a matrix with the same generations on both sides, and return it as float64.

    Raises:
        ValueError: :func:`as_results` rejects the matrix, or it is not square.
    """
    caught = as_results(caught, "caught", total)
    if len(caught) != caught.shape[1]:
        raise ValueError(f"caught must have the same generations on both sides, got shape {caught.shape}")
    return caught


@dataclass(frozen=True)
class Equilibrium:
    """A Nash equilibrium of a zero-sum game. A degenerate game has several; this is one of them."""

    value: float
    """Expected payoff of the predators when both sides play their optimal mixture (von Neumann 1928)."""
    predators: MixedStrategy
    """Probability of each row, float64 ``(G,)``, sum 1."""
    prey: MixedStrategy
    """Probability of each column, float64 ``(H,)``, sum 1."""

    @property
    def support(self) -> Sides[int]:
        """Number of generations of each side with a positive probability."""
        return Sides(int((self.predators > 1e-9).sum()), int((self.prey > 1e-9).sum()))


def solve_matrix(payoffs: PayoffMatrix) -> Equilibrium:
    """Return a Nash equilibrium of a zero-sum game: predators choose the row and get ``payoffs``, ``(G, H)``."""
    value, predators = _maximin(payoffs)
    _, prey = _maximin(-payoffs.T)
    return Equilibrium(value, predators, prey)


def mixture_exploitability(payoffs: PayoffMatrix, predators: MixedStrategy, prey: MixedStrategy) -> Sides[np.ndarray]:
    """Return the exploitability of mixtures: what a best response gains over the value ``v`` of the game.

    It is ``v - min_h (x M)_h`` for predators with mixture ``x``, and ``max_g (M y)_g - v`` for prey with mixture ``y``.
    It is 0 for an optimal mixture and positive for any other. The sum over both sides is the exploitability of the pair
    (NashConv; Lanctot et al., A unified game-theoretic approach to multiagent reinforcement learning, NeurIPS 2017).

    Args:
        payoffs: Payoff of the predators, ``(G, H)``.
        predators: Mixtures, ``(..., G)``.
        prey: Mixtures, ``(..., H)``.

    Returns:
        Exploitability of each mixture, ``(...)``, in units of the payoffs.
    """
    value = solve_matrix(payoffs).value
    return Sides(value - (predators @ payoffs).min(axis=-1), (prey @ payoffs.T).max(axis=-1) - value)


def exploitability_of_generations(payoffs: PayoffMatrix) -> Sides[Curve]:
    """Return the exploitability of each single generation: ``(G,)`` for predators and ``(H,)`` for prey."""
    return mixture_exploitability(payoffs, *map(np.eye, payoffs.shape))


def _maximin(payoffs: PayoffMatrix) -> tuple[float, MixedStrategy]:
    """Return the greatest payoff that a mixture of rows guarantees, and that mixture.

    Solves a linear program: maximise ``v`` subject to ``x M >= v``, ``x >= 0`` and ``sum(x) = 1``.
    """
    n_rows, n_columns = payoffs.shape
    found = linprog(
        c=np.append(np.zeros(n_rows), -1.0),
        A_ub=np.column_stack([-payoffs.T, np.ones(n_columns)]),
        b_ub=np.zeros(n_columns),
        A_eq=np.append(np.ones(n_rows), 0.0)[None],
        b_eq=[1.0],
        bounds=[(0, None)] * n_rows + [(None, None)],
        method="highs",
    )
    if not found.success:
        raise RuntimeError(f"the game was not solved: {found.message}")
    mixture = np.clip(found.x[:-1], 0, None)
    return float(found.x[-1]), mixture / mixture.sum()


@dataclass(frozen=True)
class Decomposition:
    """Sizes of the two orthogonal parts of a game: transitive (a ranking explains it) and cyclic (the rest)."""

    transitive: float
    """Mean square of the transitive part."""
    cyclic: float
    """Mean square of the cyclic part."""

    @property
    def transitive_share(self) -> float:
        """Fraction of the sum of squares that is transitive, in [0, 1]; nan if both parts are 0."""
        both = self.transitive + self.cyclic
        return self.transitive / both if both > 0 else float("nan")


def decompose(caught: PayoffMatrix, episodes: Noise = None, scale: PayoffScale = "shares") -> Decomposition:
    """Split predators' results against prey into a part that one strength per generation explains, and the rest.

    This is the combinatorial Hodge decomposition (Jiang, Lim, Yao & Ye, Statistical ranking and combinatorial Hodge
    theory, Mathematical Programming 127, 2011), which Balduzzi et al. (Open-ended learning in symmetric zero-sum games,
    ICML 2019) use for symmetric games. Here only predators and prey meet, so the comparisons are the edges of a
    complete bipartite graph. The transitive part is the least-squares fit ``r_g - s_h``, the row and column effects of
    a two-way layout. The cyclic part is a flow around the shortest cycles of that graph, two predators and two prey:
    which of the predators is better depends on the prey. The overall mean belongs to neither part, because a game that
    is easier for one role ranks no generation.

    The transitive part is additive in only one scale. In ``"shares"`` the correction for noise is exact, but strengths
    that lead to fractions near 0 or 1 are not additive, so the cyclic part is an upper bound. In ``"log-odds"`` a
    Bradley-Terry model is additive, and the continuity correction pulls fractions of 0 and 1 inwards.

    Args:
        caught: Fraction of prey caught, ``(G, H)``, see :func:`as_shares`; at least two generations of each side.
        episodes: Number of independent episodes behind each fraction. The expected squares of their binomial noise are
            subtracted from both parts, which do not fall below 0. The noise is computed as if all prey of an episode
            had the same fate. If they share it only in part, this subtracts too much, never too little. Instead of a
            number: the sampling variance of each entry, ``(G, H)``; the entries may then be any payoffs. None: the
            fractions are exact.
        scale: Scale in which the matrix is decomposed.
    """
    values, noise = _scaled(as_results(caught, "caught", _total(episodes)), episodes, scale)
    if min(values.shape) < 2:
        raise ValueError(f"caught must have at least two generations of each side, got shape {values.shape}")
    centred = values - values.mean()
    ladder = centred.mean(axis=1, keepdims=True) + centred.mean(axis=0, keepdims=True)
    # Degrees of freedom: the noise spreads evenly over the residuals, the row and column effects, and the mean.
    in_rest = (1 - 1 / len(values)) * (1 - 1 / values.shape[1])
    in_ladder = 1 - in_rest - 1 / values.size
    return _decomposition(ladder, centred - ladder, in_ladder * noise.mean(), in_rest * noise.mean(), values.size)


def transitive_share(caught: PayoffMatrix, episodes: int | PayoffVariance) -> float:
    """Return the fraction of the win matrix that a ranking explains, in [0, 1], by :func:`decompose`.

    It is nan if no difference exceeds the sampling noise, or if the noise cannot be estimated (one episode per pair, or
    one generation on a side).

    Args:
        caught: Fraction of prey caught, ``(G, H)``.
        episodes: Number of independent episodes behind each fraction; or the sampling variance of each entry, see
            :func:`decompose`.
    """
    unknown = np.isnan(episodes).any() if isinstance(episodes, np.ndarray) else episodes < 2
    if unknown or min(caught.shape) < 2:
        return float("nan")
    return decompose(caught, episodes).transitive_share


def _decomposition(
    ladder: PayoffMatrix, rest: PayoffMatrix, ladder_noise: float, rest_noise: float, n: int
) -> Decomposition:
    """Return the mean squares over ``n`` entries, corrected for noise and not below 0.

    Values up to 1e-24 count as rounding errors and become 0.
    """
    transitive, cyclic = float((ladder**2).sum() / n - ladder_noise), float((rest**2).sum() / n - rest_noise)
    return Decomposition(transitive if transitive > 1e-24 else 0.0, cyclic if cyclic > 1e-24 else 0.0)


def _total(episodes: Noise) -> float:
    """Return the total of the results whose noise is given: a variance belongs to payoffs of any scale."""
    return 0.0 if isinstance(episodes, np.ndarray) else 1.0


def _scaled(caught: PayoffMatrix, episodes: Noise, scale: PayoffScale) -> tuple[PayoffMatrix, PayoffVariance]:
    """Return the matrix in a scale, and the variance of its sampling noise in that scale."""
    if isinstance(episodes, np.ndarray):
        if scale != "shares":
            raise ValueError(f"payoffs with a sampling variance have no log-odds, got scale {scale!r}")
        return caught, np.broadcast_to(episodes, caught.shape)
    if episodes is not None and episodes < 2:
        raise ValueError(f"episodes must be at least 2, got {episodes}")
    if scale == "shares":
        return caught, np.zeros_like(caught) if episodes is None else share_variance(caught, episodes)
    if episodes is None:
        if not ((caught > 0) & (caught < 1)).all():
            raise ValueError("log-odds of shares of 0 or 1 need the number of episodes, got None")
        return logit(caught), np.zeros_like(caught)
    # Empirical log-odds and their variance, nearly without bias (Gart & Zweifel, Biometrika 54, 1967).
    hits, misses = caught * episodes, (1 - caught) * episodes
    variance = (episodes + 1) * (episodes + 2) / (episodes * (hits + 1) * (misses + 1))
    return np.log((hits + 0.5) / (misses + 0.5)), variance
