"""Runs against one another's late champions: a panel that is as strong as the runs themselves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from esp_trainer.analysis.comparison import caught_by_each
from esp_trainer.analysis.gains import RESAMPLES, Interval, gained
from esp_trainer.analysis.history import History
from esp_trainer.arrays import GenerationIndices
from esp_trainer.types import ROLES, Evaluator, Role
from predprey_env.agents import other_team

LATE = 3
"""Champions of each run that the others meet, evenly spread over its last sixth."""


def meet_late(histories: Sequence[History], evaluator: Evaluator, n_generations: int) -> dict[Role, np.ndarray]:
    """Play sampled generations of each run against the late champions of each other run.

    Args:
        histories: Runs of the same world and length, which evolve both sides.
        evaluator: Evaluator of their world.
        n_generations: Number of generations of each run, evenly spread.

    Returns:
        Mean result of each side, higher is better (the fraction of prey caught, or not caught), float32
        ``(n_runs, n_generations, n_runs)``; nan where a run would meet itself.
    """
    n, n_sampled = len(histories), len(histories[0].sample(n_generations))
    found: dict[Role, np.ndarray] = {role: np.full((n, n_sampled, n), np.nan, np.float32) for role in ROLES}
    for role in ROLES:
        late = [each.entrants(other_team(role), _last_sixth(each)) for each in histories]
        for i, history in enumerate(histories):
            mine, others = history.entrants(role, history.sample(n_generations)), [j for j in range(n) if j != i]
            caught = caught_by_each(role, mine, [late[j] for j in others], evaluator)
            by_run = caught.reshape(len(caught), len(others), -1).mean(axis=2)
            found[role][i][:, others] = by_run if role == "predators" else 1 - by_run
    return found


def _last_sixth(history: History) -> GenerationIndices:
    wanted = np.linspace(5 * len(history) // 6, len(history) - 1, LATE)
    return history.kept[np.searchsorted(history.kept, wanted.astype(int))]


def late_gain(found: np.ndarray, *, half: bool) -> Interval:
    """Return what runs gain against the others' late champions: the last sixth of their generations less the first, of
    the whole run or, with ``half``, of its second half.

    The interval is a percentile one. Runs are drawn with replacement, each as a run and as a member of the panel; a run
    never meets itself.

    Args:
        found: What one side reached, as :func:`meet_late` returns it.
        half: True for the second half of the runs alone.
    """
    gains = gained(found, half=half)
    apart = ~np.eye(len(gains), dtype=bool)
    drawn = np.random.default_rng(0).multinomial(len(gains), np.full(len(gains), 1 / len(gains)), RESAMPLES)
    sums, weights = (
        np.einsum("bi,ij,bj->b", drawn, each, drawn, optimize=True)
        for each in (np.where(apart, gains, 0.0), 1.0 * apart)
    )
    low, high = np.quantile((sums / np.maximum(weights, 1))[weights > 0], [0.025, 0.975])
    return Interval(float(gains[apart].mean()), float(low), float(high))
