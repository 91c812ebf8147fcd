"""Episodes between champions of a run, and the rate of each behaviour in them by generation."""

from __future__ import annotations

from esp_trainer.analysis.behaviours.counts import BehaviourRate, count_behaviours
from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.history import History
from esp_trainer.arrays import Cells, GenerationIndices
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.seeding import stream
from esp_trainer.types import TrialBatch

WATCHED_EPISODES = 128
"""Number of episodes per watched generation. A behaviour with a rate of 1 in 50 is expected in two or three of them."""


def episodes(
    history: History, evaluator: FusedEvaluator, generation: int, *, n_episodes: int = WATCHED_EPISODES, seed: int = 0
) -> tuple[Cells, Paths]:
    """Play the champions of a generation against each other, from held-out starts.

    Args:
        history: The run.
        evaluator: Evaluator of the run's world.
        generation: Generation of both champions.
        n_episodes: Number of episodes.
        seed: Seed of the starts.

    Returns:
        Cells of all agents, int32 ``(n_episodes, max_cycles + 1, n_agents, 2)`` with -1 after the end of an episode,
        and the paths of the same episodes.
    """
    starts = evaluator.starts.held_out(stream(seed, "watched"), n_episodes)
    predators = history.player("predators", generation).as_teams(n_episodes)
    prey = history.player("prey", generation).as_teams(n_episodes)
    _, trace = evaluator.play(TrialBatch(predators, prey, starts))
    env, cells = evaluator.env, trace.cells[:, 0]
    return cells, Paths.of_trace(cells, env.n_predators, env.size, trace.caught_at[:, 0])


def watch_behaviours(
    history: History,
    evaluator: FusedEvaluator,
    generations: GenerationIndices,
    *,
    n_episodes: int = WATCHED_EPISODES,
    seed: int = 0,
) -> dict[str, list[BehaviourRate]]:
    """Measure the rate of each behaviour in episodes between contemporary champions.

    Args:
        history: The run.
        evaluator: Evaluator of the run's world.
        generations: Generations to watch, int ``(n,)``.
        n_episodes: Number of episodes per generation.
        seed: Seed of the starts and of the null's pairings.

    Returns:
        For each behaviour, its rate in each generation.
    """
    rates: dict[str, list[BehaviourRate]] = {}
    for generation in generations.tolist():
        _, paths = episodes(history, evaluator, generation, n_episodes=n_episodes, seed=seed)
        for name, rate in count_behaviours(paths, stream(seed, "null", generation)).items():
            rates.setdefault(name, []).append(rate)
    return rates
