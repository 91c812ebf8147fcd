"""Means of runs against a panel with intervals over both, and a test of whether both sides of a race gain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from esp_trainer.analysis.inference import signed
from esp_trainer.arrays import SeedValues

RESAMPLES = 10_000


@dataclass(frozen=True)
class Interval:
    """A mean over runs and opponents with its 95% interval over both. As text it has signs."""

    mean: float
    low: float
    high: float

    def __str__(self) -> str:
        return signed(self.mean, self.low, self.high)


def over_runs_and_panel(table: np.ndarray, per_run: int = 1, seed: int = 0) -> Interval:
    """Return the mean of a table with a percentile interval that counts runs and opponents as samples.

    Runs and runs of the panel are drawn with replacement (Owen, The pigeonhole bootstrap, Annals of Applied Statistics
    1, 2007).

    Args:
        table: What each run did against each opponent, ``(n_seeds, n_opponents)``.
        per_run: Number of opponents, in columns side by side, that come from the same run.
        seed: Of the drawn samples.
    """
    generator = np.random.default_rng(seed)
    by_member = table.reshape(len(table), -1, per_run).mean(axis=2)
    rows = generator.multinomial(len(table), np.full(len(table), 1 / len(table)), RESAMPLES)
    n_members = by_member.shape[1]
    columns = generator.multinomial(n_members, np.full(n_members, 1 / n_members), RESAMPLES)
    means = np.einsum("br,rc,bc->b", rows, by_member, columns, optimize=True) / (len(table) * n_members)
    low, high = np.quantile(means, [0.025, 0.975])
    return Interval(float(by_member.mean()), float(low), float(high))


def sixths(found: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the first and the last sixth of the generations of an array ``(n_seeds, n_generations, ...)``."""
    sixth = max(1, found.shape[1] // 6)
    return found[:, :sixth], found[:, -sixth:]


def gained(found: np.ndarray, *, half: bool) -> np.ndarray:
    """Return the last sixth of the generations less the first, of an array ``(n_seeds, n_generations, ...)`` or, with
    ``half``, of its second half.
    """
    first, last = sixths(found[:, found.shape[1] // 2 :] if half else found)
    return np.asarray(last.mean(axis=1) - first.mean(axis=1))


def by_third(found: np.ndarray) -> np.ndarray:
    """Return the means of three equal parts of each run's values ``(n_seeds, n)``, ``(n_seeds, 3)``."""
    return np.stack([part.mean(axis=1) for part in np.array_split(found, 3, axis=1)], axis=1)


def lesser_gain(predators: SeedValues, prey: SeedValues, seed: int = 0) -> tuple[float, float]:
    """Return the mean over runs of the lesser side's gain, and its one-sided p.

    The lesser of two noisy numbers is below 0 where nothing changes, so it is not tested against 0. Where nothing
    changes, a run read backwards is as likely as the run, and turns the sign of both gains: the null distribution is
    that of the mean over all ways to turn runs round.

    Args:
        predators: Gain of each run's predators, ``(n_seeds,)``.
        prey: Of its prey.
        seed: Of the drawn signs.
    """
    forwards, backwards = np.minimum(predators, prey), np.minimum(-predators, -prey)
    found = float(forwards.mean())
    turned = np.random.default_rng(seed).random((RESAMPLES, len(forwards))) < 0.5
    null = np.where(turned, backwards, forwards).mean(axis=1)
    return found, float((1 + (null >= found - 1e-12).sum()) / (1 + RESAMPLES))
