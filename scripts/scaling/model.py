"""From what was measured on one machine to what several would give; every assumption in one place."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scaling.growth import Grown
from scaling.sharding import Measured


class Model(NamedTuple):
    """Seconds of a generation, as a sum of what it consists of."""

    per_trial: float
    """CPU seconds of a trial on a worker."""
    driver_fixed: float
    """Of the driver for a batch."""
    driver_per_shard: float
    driver_per_trial: float
    round_trip: float
    rest: float
    """All that is not trials, in a generation of 1,000."""
    rest_per_trial: float
    """What each further trial adds to that: its share of fitness."""

    def alone(self, n_trials: int, cores: int) -> float:
        """One machine, a thread for each core, were threads perfect."""
        return self._rest(n_trials) + n_trials * self.per_trial / cores

    def shared(self, n_trials: int, cores: int) -> float:
        """A cluster with so many cores, a shard for each, the driver's work not overlapping with theirs."""
        return self._rest(n_trials) + self._driver(n_trials, cores) + n_trials * self.per_trial / cores

    def best(self, n_trials: int) -> tuple[int, float]:
        """The number of cores, a power of two, beyond which a generation takes longer, and its seconds."""
        return min(((2**k, self.shared(n_trials, 2**k)) for k in range(16)), key=lambda each: each[1])

    def bottleneck(self, n_trials: int) -> int:
        """The number of cores, a power of two, from which the driver's share takes longer than the trials."""
        return next(2**k for k in range(20) if self._driver(n_trials, 2**k) > n_trials * self.per_trial / 2**k)

    def pays_from(self, cores: int, machines: int) -> int | None:
        """Trials from which a cluster of ``machines`` beats one of them, each with so many cores; None for never."""
        gain = self.per_trial * (1 / cores - 1 / (cores * machines)) - self.driver_per_trial
        fixed = self.round_trip + self.driver_fixed + self.driver_per_shard * cores * machines
        return round(fixed / gain) if gain > 0 else None

    def _driver(self, n_trials: int, cores: int) -> float:
        return self.round_trip + self.driver_fixed + self.driver_per_shard * cores + self.driver_per_trial * n_trials

    def _rest(self, n_trials: int) -> float:
        return self.rest + self.rest_per_trial * (n_trials - 1000)


def fit(grown: list[Grown], shared: Measured) -> Model:
    """Least squares of the driver's CPU seconds on shards and trials; the rest is read off."""
    batches = shared.batches
    design = np.array([[1.0, each.shards, each.n_trials] for each in batches])
    weights = 1 / np.sqrt([each.n_trials for each in batches])  # or the largest batches alone would decide
    driver = np.array([each.driver for each in batches])
    fixed, per_shard, per_trial = np.linalg.lstsq(design * weights[:, None], driver * weights, rcond=None)[0]
    same = [each for each in grown if each.subpopulation_size == grown[0].subpopulation_size]
    growth = (same[-1].rest - same[0].rest) / (same[-1].n_trials - same[0].n_trials)
    return Model(
        per_trial=batches[-1].cpu / batches[-1].n_trials,
        driver_fixed=max(0.0, float(fixed)),
        driver_per_shard=float(per_shard),
        driver_per_trial=max(0.0, float(per_trial)),
        round_trip=shared.round_trip,
        rest=same[0].rest,
        rest_per_trial=max(0.0, growth),
    )
