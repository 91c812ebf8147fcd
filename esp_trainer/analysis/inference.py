"""What a handful of seeds says. A seed is the unit: its episodes and generations are not independent of each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import floor, inf, sqrt

import numpy as np
from scipy import stats
from scipy.stats import mannwhitneyu, permutation_test

MIN_SEEDS = 3
"""Fewest seeds for which an interval is reported. With two, Student's interval is 12.7 standard errors to each side."""

_Z_95 = 1.959963984540054
_MAX_FLIPS = 2**14  # all signs of up to 14 seeds, so p is exact; of more, that many at random


@dataclass(frozen=True)
class Estimate:
    """A mean over seeds with its 95% interval."""

    mean: float
    low: float
    high: float
    n: int
    """Seeds."""

    def __str__(self) -> str:
        return f"{self.mean:z.3f} [{self.low:z.3f}, {self.high:z.3f}]"


@dataclass(frozen=True)
class Comparison:
    """A difference with its 95% interval, and a test of there being none."""

    difference: float
    low: float
    high: float
    effect: float
    """Cliff's delta, in [-1, 1]: chance that one is greater than the other, less the chance that it is smaller."""
    p: float
    """Two-sided."""

    def __str__(self) -> str:
        # Not rounded to an unsigned zero: the sign of an end says on which side of 0 it lies.
        interval = f"{self.difference:+.3f} [{self.low:+.3f}, {self.high:+.3f}]"
        return f"{interval}, delta {self.effect:+.2f}, p {self.p:.2g}"


def over_seeds(values: Sequence[float] | np.ndarray) -> Estimate:
    """Mean over seeds with Student's 95% interval.

    Not a bootstrap: at about ten seeds its intervals are too narrow, as it takes the spread of the sample for that of
    all seeds, while Student's hold the level for normal values and nearly so for means of others.

    Args:
        values: One number for each seed, at least two.
    """
    values = _as_sample("values", values)
    n, mean = len(values), float(values.mean())
    half = float(stats.t.ppf(0.975, n - 1) * values.std(ddof=1) / sqrt(n))
    return Estimate(mean, mean - half, mean + half, n)


def summary(values: Sequence[float] | np.ndarray) -> str:
    """Return the mean over seeds in words, with its interval from :data:`MIN_SEEDS` seeds on; ``-`` for no seed."""
    if len(values) < MIN_SEEDS:
        return f"{sum(values) / len(values):z.3f}" if len(values) else "-"
    return str(over_seeds(values))


def interval_of_curves(curves: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean over runs ``(n_runs, n)`` and both ends of its 95% interval (Student's, as :func:`over_seeds`), point by
    point: each ``(n,)``. Of fewer runs than :data:`MIN_SEEDS` all three are the mean.
    """
    mean = curves.mean(axis=0)
    if len(curves) < MIN_SEEDS:
        return mean, mean, mean
    half = stats.t.ppf(0.975, len(curves) - 1) * curves.std(axis=0, ddof=1) / np.sqrt(len(curves))
    return mean, mean - half, mean + half


def compare(a: Sequence[float] | np.ndarray, b: Sequence[float] | np.ndarray) -> Comparison:
    """Seeds of one kind against independent seeds of another.

    Difference: Hodges & Lehmann's, the median of all differences ``a_i - b_j``, with the interval that belongs to the
    rank test (Hollander & Wolfe, Nonparametric Statistical Methods, 1999, section 4.3; infinite where there are too few
    seeds for 95%). Test: Mann & Whitney's U, exact without ties. Effect: Cliff's delta (Psychological Bulletin 114,
    1993). All by ranks, since runs that found a trick and runs that did not make two heaps.

    Args:
        a: One number for each seed, at least two.
        b: The same of the other kind.
    """
    a, b = _as_sample("a", a), _as_sample("b", b)
    differences = np.sort((a[:, None] - b).ravel())
    n_pairs = len(differences)
    outside = floor(n_pairs / 2 - _Z_95 * sqrt(n_pairs * (len(a) + len(b) + 1) / 12))
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


def against(values: Sequence[float] | np.ndarray, null: float = 0.0) -> Comparison:
    """Seeds against a fixed number, such as no progress.

    Difference: mean less ``null``, with the interval of :func:`over_seeds`. Test: Fisher's, by flipping the signs of
    the differences in all ways, exact for up to 14 seeds whatever their ties, if the differences are symmetric about 0
    where there is nothing to find; ten seeds can reach 1 / 512. Effect: Cliff's delta against ``null``.

    Args:
        values: One number for each seed, at least two.
        null: What is expected where there is nothing to find.
    """
    differences = _as_sample("values", values) - null
    estimate = over_seeds(differences)
    flips = permutation_test(
        (differences,),
        lambda x, axis: x.mean(axis=axis),
        permutation_type="samples",
        vectorized=True,
        n_resamples=_MAX_FLIPS,
        rng=np.random.default_rng(0),  # the same p for the same values
    )
    effect = float(np.sign(differences).mean())
    return Comparison(estimate.mean, estimate.low, estimate.high, effect, float(flips.pvalue))


def holm(p_values: Sequence[float] | np.ndarray) -> np.ndarray:
    """p-values for a family of tests: below 0.05 where Holm's procedure rejects at 0.05, which holds the chance of any
    false rejection to that whatever their dependence (Holm, Scandinavian Journal of Statistics 6, 1979).

    Args:
        p_values: ``(n,)``.

    Returns:
        float64 ``(n,)``, in the order given.
    """
    p = np.asarray(p_values, np.float64)
    if p.ndim != 1 or not ((p >= 0) & (p <= 1)).all():
        raise ValueError(f"p_values must be numbers in [0, 1], (n,), got {p_values}")
    order = np.argsort(p)
    adjusted = np.empty_like(p)
    adjusted[order] = np.minimum(1, np.maximum.accumulate(p[order] * np.arange(len(p), 0, -1)))
    return adjusted


def _as_sample(name: str, values: Sequence[float] | np.ndarray) -> np.ndarray:
    sample = np.asarray(values, np.float64)
    if sample.ndim != 1 or len(sample) < 2 or not np.isfinite(sample).all():
        raise ValueError(f"{name} must hold a finite number for each of at least two seeds, got {values}")
    return sample
