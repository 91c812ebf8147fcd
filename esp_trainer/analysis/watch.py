"""Champions watched: how often each behaviour is seen in each generation of a run."""

from __future__ import annotations

import numpy as np

from esp_trainer.analysis.behaviours.counts import BehaviourRate, count_behaviours
from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.history import History
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.seeding import stream
from esp_trainer.types import TrialBatch

EPISODES = 128
"""Of each generation that is watched: a rate of one in fifty is seen in two or three of them."""


def episodes(
    history: History, evaluator: FusedEvaluator, generation: int, *, n_episodes: int = EPISODES, seed: int = 0
) -> tuple[np.ndarray, Paths]:
    """Champion against champion of a generation, from held-out starts.

    Args:
        history: The run.
        evaluator: Of its world.
        generation: Which.
        n_episodes: How many.
        seed: Which starts.

    Returns:
        Everybody's cells, int32 ``(n_episodes, max_cycles + 1, n_agents, 2)`` with -1 after the end, and their paths.
    """
    starts = evaluator.starts.held_out(stream(seed, "watched"), n_episodes)
    predators = history.player("predators", generation).as_teams(n_episodes)
    prey = history.player("prey", generation).as_teams(n_episodes)
    result, trace = evaluator.play(TrialBatch(predators, prey, starts))
    env = evaluator.env
    return trace[:, 0], Paths.of_trace(trace[:, 0], env.n_predators, env.size, result.captured[:, 0])


def watch(
    history: History, evaluator: FusedEvaluator, generations: np.ndarray, *, n_episodes: int = EPISODES, seed: int = 0
) -> dict[str, list[BehaviourRate]]:
    """The behaviours of contemporaries: for each of them a rate in each of the ``generations``, int ``(n,)``; the other
    arguments are those of :func:`episodes`.
    """
    rates: dict[str, list[BehaviourRate]] = {}
    for generation in generations.tolist():
        _, paths = episodes(history, evaluator, generation, n_episodes=n_episodes, seed=seed)
        for name, rate in count_behaviours(paths, stream(seed, "null", generation)).items():
            rates.setdefault(name, []).append(rate)
    return rates
