"""Episodes as the algorithm needs them: played, and with a fitness that can be compared."""

from __future__ import annotations

import numpy as np

from esp_trainer.types import ROLES, Evaluator, TrialBatch, TrialResult


def play(evaluator: Evaluator, batch: TrialBatch) -> TrialResult:
    """Play a batch.

    Raises :class:`ValueError` if the evaluator returns a fitness of another shape than the batch, or one that is not
    finite: whose, and in which episode.
    """
    result = evaluator.evaluate(batch)
    if result.fitness.shape[:2] != batch.starts.shape[:2]:
        expected = "{} trials of {} episodes".format(*batch.starts.shape[:2])
        raise ValueError(f"the evaluator must return the fitness of {expected}, got shape {result.fitness.shape}")
    for role in ROLES:
        fitness = result.fitness_of(role)
        wrong = np.argwhere(~np.isfinite(fitness))
        if len(wrong):
            trial, episode, agent = wrong[0].tolist()
            got = fitness[trial, episode, agent]
            raise ValueError(
                f"fitness must be finite, got {got} for agent {agent} of the {role} in trial {trial}, episode {episode}"
            )
    return result
