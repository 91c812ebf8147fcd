"""The evaluator that plays the trials of a run."""

from __future__ import annotations

from esp_trainer.config import RunConfig
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.evaluation.other_game import GameEvaluator


def make_evaluator(config: RunConfig, threads: int | None = None) -> FusedEvaluator | GameEvaluator:
    """Return the evaluator of a config's game.

    Args:
        config: The config.
        threads: Number of threads in the predator-prey world, and of processes in any other game; by default one for
            each core.
    """
    if config.game.environment:
        return GameEvaluator(config.game, threads)
    return FusedEvaluator(config.env, threads)
