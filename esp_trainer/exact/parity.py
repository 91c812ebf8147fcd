"""Means of values over all starts, and over the starts with each number of predators at an even distance."""

from __future__ import annotations

import numpy as np

from esp_trainer.arrays import Counts, StateValues
from esp_trainer.exact.solution import Solution
from predprey_env.config import EnvConfig


def by_parity(solution: Solution, steps: int) -> tuple[float, list[float]]:
    """Return the mean fraction of prey caught over all starts, and over those with 0, 1, 2, ... predators at an even
    distance.

    See :func:`means_by_parity`.
    """
    caught = solution.values[steps * len(solution.turns), solution.states.first[-2] :]
    return _means(caught, solution.weights, solution.even, solution.config)


def means_by_parity(values: StateValues, solution: Solution) -> tuple[float, list[float]]:
    """Return the mean fraction of prey caught over all starts, and by the number of predators at an even distance.

    A start has no predator in a prey's cell; all starts have equal weight. (The environment places the prey last, so
    starts in which predators share a cell are a little rarer there.) With several prey, the number counts pairs of a
    predator and a prey at an even distance; the mean of a number that cannot occur is nan.

    Args:
        values: Number of prey caught, for each key with all prey free, ``(n_keys,)``.
        solution: Solution of the same game.
    """
    starts = solution.number >= 0
    even = solution.even[solution.number[starts] - solution.states.first[-2]]
    return _means(values[starts], np.ones(len(even)), even, solution.config)


def _means(caught: StateValues, weights: np.ndarray, even: Counts, config: EnvConfig) -> tuple[float, list[float]]:
    shares = caught / config.n_prey
    means = [
        float(np.average(shares[even == n], weights=weights[even == n])) if (even == n).any() else float("nan")
        for n in range(config.n_predators * config.n_prey + 1)
    ]
    return float(np.average(shares, weights=weights)), means
