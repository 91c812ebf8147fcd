"""The empirical game between the generations of a run: what optimal mixtures get, and how much of it is a ladder."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, Literal, NamedTuple, TypeAlias, TypeVar

import numpy as np
from scipy.optimize import linprog
from scipy.special import logit

T = TypeVar("T")
Scale: TypeAlias = Literal["shares", "log-odds"]


class Sides(NamedTuple, Generic[T]):
    """The same of both sides."""

    predators: T
    prey: T


def as_shares(values: np.ndarray, name: str = "caught") -> np.ndarray:
    """The matrix that everything here starts from, checked.

    Args:
        values: ``(G, H)``: share of prey caught by the predators of generation ``g`` from the prey of generation ``h``,
            oldest first.
        name: What an error calls it.

    Returns:
        The same as float64.

    Raises:
        ValueError: It is not a matrix, is empty, or has an entry outside [0, 1].
    """
    shares = np.asarray(values, np.float64)
    if shares.ndim != 2 or not shares.size:
        raise ValueError(f"{name} must have shape (G, H), got {shares.shape}")
    if not ((shares >= 0) & (shares <= 1)).all():  # false of nan too
        raise ValueError(f"{name} must lie in [0, 1], got {shares.min()} to {shares.max()}")
    return shares


def as_square(caught: np.ndarray) -> np.ndarray:
    """The matrix of the same generations on both sides, checked.

    Raises:
        ValueError: As for :func:`as_shares`, or it is not square.
    """
    caught = as_shares(caught)
    if len(caught) != caught.shape[1]:
        raise ValueError(f"caught must have the same generations on both sides, got shape {caught.shape}")
    return caught


@dataclass(frozen=True)
class Equilibrium:
    """Optimal mixtures of a zero-sum game. A degenerate game has several; this is one of them."""

    value: float
    """What the predators get when both sides mix optimally (von Neumann 1928)."""
    predators: np.ndarray
    """float64 ``(G,)``: weights of the rows, sum 1."""
    prey: np.ndarray
    """float64 ``(H,)``: weights of the columns, sum 1."""

    @property
    def support(self) -> Sides[int]:
        """How many generations of each side have a weight."""
        return Sides(int((self.predators > 1e-9).sum()), int((self.prey > 1e-9).sum()))


def solve(payoffs: np.ndarray) -> Equilibrium:
    """Nash equilibrium of the zero-sum game in which predators, who choose the row, get ``payoffs`` ``(G, H)``."""
    value, predators = _maximin(payoffs)
    _, prey = _maximin(-payoffs.T)
    return Equilibrium(value, predators, prey)


def exploitability(payoffs: np.ndarray, predators: np.ndarray, prey: np.ndarray) -> Sides[np.ndarray]:
    """How far from optimal mixtures are: what a best response takes from each, beyond the value ``v`` of the game.

    ``v - min_h (x M)_h`` for predators that mix by ``x``, and ``max_g (M y)_g - v`` for prey that mix by ``y``: 0 for
    an optimal mixture, above 0 for any other. Their sum is the exploitability of the pair (NashConv; Lanctot et al., A
    unified game-theoretic approach to multiagent reinforcement learning, NeurIPS 2017).

    Args:
        payoffs: ``(G, H)``, what predators get.
        predators: Mixtures ``(..., G)``.
        prey: Mixtures ``(..., H)``.

    Returns:
        Of each mixture, in units of the payoffs: ``(...)``.
    """
    value = solve(payoffs).value
    return Sides(value - (predators @ payoffs).min(axis=-1), (prey @ payoffs.T).max(axis=-1) - value)


def exploitability_of_generations(payoffs: np.ndarray) -> Sides[np.ndarray]:
    """:func:`exploitability` of every generation by itself: ``(G,)`` for predators and ``(H,)`` for prey."""
    return exploitability(payoffs, *map(np.eye, payoffs.shape))


def _maximin(payoffs: np.ndarray) -> tuple[float, np.ndarray]:
    """The mixture of rows with the greatest sure payoff ``v``: maximise ``v`` with ``x M >= v``, ``x >= 0``, sum 1."""
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
    """A game as the sum of a ladder and the rest, which stand at right angles to each other."""

    transitive: float
    """Mean square of the ladder."""
    cyclic: float
    """Mean square of the rest."""

    @property
    def transitive_share(self) -> float:
        """Share of the sum of squares that is the ladder's, in [0, 1]; nan where there is nothing to divide."""
        both = self.transitive + self.cyclic
        return self.transitive / both if both > 0 else float("nan")


def decompose(caught: np.ndarray, episodes: int | None = None, scale: Scale = "shares") -> Decomposition:
    """Predators against prey: how much of the results one strength for each generation explains.

    The combinatorial Hodge decomposition (Jiang, Lim, Yao & Ye, Statistical ranking and combinatorial Hodge theory,
    Mathematical Programming 127, 2011), which Balduzzi et al. (Open-ended learning in symmetric zero-sum games, ICML
    2019) use for symmetric games. Here only predators and prey meet, so the comparisons are the edges of a complete
    bipartite graph, and the gradient flow is the best fit ``r_g - s_h`` by least squares: mean, rows and columns of a
    two-way layout. What is left is a flow around the shortest cycles that there are, two predators and two prey: which
    predators are better depends on the prey. The overall mean is left out: that one role has the easier life ranks
    nobody.

    A ladder is only additive in a scale. In ``"shares"`` the correction for noise is exact, but a ladder that runs into
    0 or 1 leaves a rest, so the cyclic part is an upper bound; in ``"log-odds"`` a Bradley-Terry ladder is additive,
    and shares of 0 and 1 are drawn in by the continuity correction.

    Args:
        caught: ``(G, H)``, see :func:`as_shares`; at least two generations of each side.
        episodes: Independent episodes behind each share. The expected squares of their binomial noise are taken off
            both parts, down to 0. Where prey of one episode share their fate in part, that takes off too much, never
            too little. None: the shares are exact.
        scale: What is decomposed.
    """
    values, noise = _scaled(as_shares(caught), episodes, scale)
    if min(values.shape) < 2:
        raise ValueError(f"caught must have at least two generations of each side, got shape {values.shape}")
    centred = values - values.mean()
    ladder = centred.mean(axis=1, keepdims=True) + centred.mean(axis=0, keepdims=True)
    in_rest = (1 - 1 / len(values)) * (1 - 1 / values.shape[1])  # share of the noise that the fit leaves
    in_ladder = 1 - in_rest - 1 / values.size  # the mean takes what is missing
    return _decomposition(ladder, centred - ladder, in_ladder * noise.mean(), in_rest * noise.mean(), values.size)


def transitive_share(caught: np.ndarray, episodes: int) -> float:
    """Fraction of the win matrix that a ranking explains, in [0, 1], by :func:`decompose`.

    nan if no difference exceeds chance, or if chance cannot be estimated (one episode a pair, or one generation on a
    side).

    Args:
        caught: As for :func:`decompose`, ``(G, H)``.
        episodes: Independent episodes behind each share.
    """
    if episodes < 2 or min(caught.shape) < 2:
        return float("nan")
    return decompose(caught, episodes).transitive_share


def decompose_generations(caught: np.ndarray, episodes: int | None = None, scale: Scale = "shares") -> Decomposition:
    """Generation against generation, each playing both roles: how much of who beats whom is a ladder.

    ``A[g, k] = M[g, k] - M[k, g]`` is a symmetric zero-sum game. Its ladder is the gradient ``r_g - r_k`` of the
    means ``r`` of its rows; the rest is curl, as in rock-paper-scissors (Balduzzi et al. 2019, as in
    :func:`decompose`). Blind to what is alike in both roles, such as predators that know only the prey of their time.

    Args:
        caught: ``(G, G)``, see :func:`as_square`; at least three generations, as fewer have no cycle.
        episodes: As in :func:`decompose`.
        scale: As in :func:`decompose`.
    """
    values, noise = _scaled(as_square(caught), episodes, scale)
    n = len(values)
    if n < 3:
        raise ValueError(f"a cycle takes at least three generations, got {n}")
    game = values - values.T
    strength = game.mean(axis=1)
    ladder = strength[:, None] - strength
    noise_off_diagonal = (noise + noise.T)[~np.eye(n, dtype=bool)].mean()
    in_ladder = 2 / n  # n - 1 strengths out of n (n - 1) / 2 pairs
    return _decomposition(
        ladder, game - ladder, in_ladder * noise_off_diagonal, (1 - in_ladder) * noise_off_diagonal, n * (n - 1)
    )


def _decomposition(
    ladder: np.ndarray, rest: np.ndarray, ladder_noise: float, rest_noise: float, n: int
) -> Decomposition:
    """Mean squares over ``n`` entries, less what noise adds to them. What rounding leaves of nothing is 0."""
    transitive, cyclic = float((ladder**2).sum() / n - ladder_noise), float((rest**2).sum() / n - rest_noise)
    return Decomposition(transitive if transitive > 1e-24 else 0.0, cyclic if cyclic > 1e-24 else 0.0)


def _scaled(caught: np.ndarray, episodes: int | None, scale: Scale) -> tuple[np.ndarray, np.ndarray]:
    """The shares in a scale, and the variance of their sampling noise there."""
    if episodes is not None and episodes < 2:
        raise ValueError(f"episodes must be at least 2, got {episodes}")
    if scale == "shares":
        # Over n - 1 this estimates the variance of the share, p (1 - p) / n, without bias.
        return caught, np.zeros_like(caught) if episodes is None else caught * (1 - caught) / (episodes - 1)
    if episodes is None:
        if not ((caught > 0) & (caught < 1)).all():
            raise ValueError("log-odds of shares of 0 or 1 need the number of episodes, got None")
        return logit(caught), np.zeros_like(caught)
    # Empirical log-odds and their variance, nearly without bias (Gart & Zweifel, Biometrika 54, 1967).
    hits, misses = caught * episodes, (1 - caught) * episodes
    variance = (episodes + 1) * (episodes + 2) / (episodes * (hits + 1) * (misses + 1))
    return np.log((hits + 0.5) / (misses + 0.5)), variance
