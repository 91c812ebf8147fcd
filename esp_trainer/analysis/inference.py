"""Intervals and tests over a few seeds.

A seed is the unit of every statistic, because the episodes and generations of a run are not independent of each other.

Intervals do not use SciPy, so that the table of a sweep can show them without it. The tests import SciPy.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import cos, floor, inf, pi, sin, sqrt, tan

import numpy as np

from esp_trainer.arrays import Curve, CurvesOfRuns, SeedValues
from esp_trainer.statistics import Z_95

MIN_SEEDS = 3
"""Minimum number of seeds for an interval. With two seeds, Student's 95% interval is 12.7 standard errors each way."""

_MAX_FLIPS = 2**14  # all sign patterns of up to 14 seeds, so p is exact; with more seeds, a random sample of patterns


@dataclass(frozen=True)
class Estimate:
    """A mean over seeds with its 95% interval."""

    mean: float
    low: float
    high: float
    n: int
    """Number of seeds."""

    def __str__(self) -> str:
        return f"{self.mean:z.3f} [{self.low:z.3f}, {self.high:z.3f}]"

    @property
    def signed(self) -> str:
        """The mean of a change, with its interval, as text with signs."""
        return signed(self.mean, self.low, self.high)


@dataclass(frozen=True)
class Comparison:
    """A difference with its 95% interval, effect size, and the p-value of a test of no difference."""

    difference: float
    low: float
    high: float
    effect: float
    """Cliff's delta, in [-1, 1]: probability that a value of the first kind is greater than one of the second, minus
    the probability that it is smaller."""
    p: float
    """Two-sided p-value."""

    def __str__(self) -> str:
        return f"{self.interval}, delta {self.effect:+.2f}, p {self.p:.2g}"

    @property
    def interval(self) -> str:
        """The difference, with its interval, as text with signs."""
        return signed(self.difference, self.low, self.high)


def signed(value: float, low: float, high: float) -> str:
    """Return a change and its interval as text with signs, ``+0.062 [+0.019, +0.102]``."""
    # No "z" format: the sign of a rounded zero shows on which side of 0 the end of an interval lies.
    return f"{value:+.3f} [{low:+.3f}, {high:+.3f}]"


def over_seeds(values: Sequence[float] | SeedValues) -> Estimate:
    """Return the mean over seeds with Student's 95% interval.

    A bootstrap is not used: with about ten seeds its intervals are too narrow, because it takes the spread of the
    sample for that of the population. Student's interval has exact coverage for normal values, and nearly so for means
    of other values.

    Args:
        values: One value per seed, at least two.
    """
    values = _as_sample("values", values)
    n, mean = len(values), float(values.mean())
    half = float(student_95(n - 1) * values.std(ddof=1) / sqrt(n))
    return Estimate(mean, mean - half, mean + half, n)


def summary(values: Sequence[float] | SeedValues) -> str:
    """Return the mean over seeds as text, with its interval for :data:`MIN_SEEDS` seeds or more; ``-`` for no seed."""
    if len(values) < MIN_SEEDS:
        return f"{sum(values) / len(values):z.3f}" if len(values) else "-"
    return str(over_seeds(values))


def interval_of_curves(curves: CurvesOfRuns) -> tuple[Curve, Curve, Curve]:
    """Return the mean over runs and both ends of its 95% interval (Student's, see :func:`over_seeds`), point by point.

    Args:
        curves: One curve per run, ``(n_runs, n)``.

    Returns:
        Mean, low and high, ``(n,)`` each. With fewer runs than :data:`MIN_SEEDS` all three are the mean.
    """
    mean = curves.mean(axis=0)
    if len(curves) < MIN_SEEDS:
        return mean, mean, mean
    half = student_95(len(curves) - 1) * curves.std(axis=0, ddof=1) / np.sqrt(len(curves))
    return mean, mean - half, mean + half


@lru_cache
def student_95(degrees: int) -> float:
    """Return the value that Student's t exceeds in magnitude with probability 5%.

    The distribution of an integer number of degrees of freedom is a finite sum (Abramowitz & Stegun, Handbook of
    Mathematical Functions, 1964, 26.7.3 and 26.7.4) of the angle ``atan(t / sqrt(degrees))``, inverted by bisection.
    """
    low, high = 0.0, pi / 2
    for _ in range(60):  # more than the 53 bits of a float
        middle = (low + high) / 2
        low, high = (middle, high) if _within(middle, degrees) < 0.95 else (low, middle)
    return sqrt(degrees) * tan(low)


def _within(angle: float, degrees: int) -> float:
    """Return the probability that ``|t|`` is below ``sqrt(degrees) * tan(angle)``."""
    term = total = 1.0 if degrees % 2 == 0 else cos(angle)
    for i in range(2 + degrees % 2, degrees - 1, 2):
        term *= cos(angle) ** 2 * (i - 1) / i
        total += term
    if degrees % 2 == 0:
        return sin(angle) * total
    return 2 / pi * (angle + sin(angle) * total * (degrees > 1))


def compare(a: Sequence[float] | SeedValues, b: Sequence[float] | SeedValues) -> Comparison:
    """Compare seeds of one kind with independent seeds of another.

    * Difference: Hodges-Lehmann estimate, the median of all differences ``a_i - b_j``, with the interval that belongs
      to the rank test (Hollander & Wolfe, Nonparametric Statistical Methods, 1999, section 4.3). The interval is
      infinite if there are too few seeds for 95%.
    * Test: Mann-Whitney U test, exact if there are no ties.
    * Effect: Cliff's delta (Psychological Bulletin 114, 1993).

    All three use ranks, because values are often bimodal: some runs find a trick and others do not.

    Args:
        a: One value per seed of the first kind, at least two.
        b: One value per seed of the second kind, at least two.
    """
    from scipy.stats import mannwhitneyu

    a, b = _as_sample("a", a), _as_sample("b", b)
    differences = np.sort((a[:, None] - b).ravel())
    n_pairs = len(differences)
    outside = floor(n_pairs / 2 - Z_95 * sqrt(n_pairs * (len(a) + len(b) + 1) / 12))
    low, high = (differences[outside - 1], differences[-outside]) if outside > 0 else (-inf, inf)
    tied = len(np.unique(np.concatenate([a, b]))) < len(a) + len(b)
    test = mannwhitneyu(a, b, method="asymptotic" if tied else "exact")
    return Comparison(
        difference=float(np.median(differences)),
        low=float(low),
        high=float(high),
        effect=float(np.sign(differences).mean()),
        p=float(test.pvalue),
    )


def against(values: Sequence[float] | SeedValues, null: float = 0.0) -> Comparison:
    """Compare seeds with a fixed value, such as 0 for no progress.

    * Difference: mean minus ``null``, with the interval of :func:`over_seeds`.
    * Test: Fisher's randomisation test, which flips the signs of the differences in all ways. It assumes that the
      differences are symmetric about 0 under the null hypothesis, and is then exact for up to 14 seeds, with ties too.
      The smallest p of ten seeds is 1 / 512.
    * Effect: Cliff's delta against ``null``.

    Args:
        values: One value per seed, at least two.
        null: Expected value under the null hypothesis.
    """
    from scipy.stats import permutation_test

    differences = _as_sample("values", values) - null
    estimate = over_seeds(differences)
    flips = permutation_test(
        (differences,),
        lambda x, axis: x.mean(axis=axis),
        permutation_type="samples",
        vectorized=True,
        n_resamples=_MAX_FLIPS,
        rng=np.random.default_rng(0),  # a fixed seed, so that the same values give the same p
    )
    effect = float(np.sign(differences).mean())
    return Comparison(estimate.mean, estimate.low, estimate.high, effect, float(flips.pvalue))


def holm(p_values: Sequence[float] | np.ndarray) -> np.ndarray:
    """Correct the p-values of a family of tests by Holm's procedure (Scandinavian Journal of Statistics 6, 1979).

    Rejecting where the corrected p is at most 0.05 keeps the probability of any false rejection at or below 0.05,
    however the tests depend on each other.

    Args:
        p_values: Uncorrected p-values, ``(n,)``.

    Returns:
        Corrected p-values, float64 ``(n,)``, in the same order.
    """
    p = np.asarray(p_values, np.float64)
    if p.ndim != 1 or not ((p >= 0) & (p <= 1)).all():
        raise ValueError(f"p_values must be numbers in [0, 1], (n,), got {p_values}")
    order = np.argsort(p)
    adjusted = np.empty_like(p)
    adjusted[order] = np.minimum(1, np.maximum.accumulate(p[order] * np.arange(len(p), 0, -1)))
    return adjusted


def _as_sample(name: str, values: Sequence[float] | SeedValues) -> SeedValues:
    sample = np.asarray(values, np.float64)
    if sample.ndim != 1 or len(sample) < 2 or not np.isfinite(sample).all():
        raise ValueError(f"{name} must hold a finite number for each of at least two seeds, got {values}")
    return sample
