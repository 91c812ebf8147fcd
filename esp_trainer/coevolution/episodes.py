"""Episodes for the algorithm: played by an evaluator whose results are checked."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from esp_trainer.types import ROLES, Evaluator, TrialBatch, TrialResult

_MOST = 1e100  # largest fitness, so that sums stay finite


def play_batch(evaluator: Evaluator, batch: TrialBatch) -> TrialResult:
    """Play a batch.

    Raises :class:`ValueError` if the evaluator returns arrays of another shape or type than
    :class:`~esp_trainer.types.TrialResult` has, or a fitness that is not finite, with its agent, trial and episode.
    """
    result = evaluator.evaluate(batch)
    fitness, captured = np.asarray(result.fitness), np.asarray(result.captured)
    shape, n_prey = batch.starts.shape[:2], captured.shape[-1] if captured.ndim else 0
    if captured.dtype != np.bool_ or captured.shape != (*shape, n_prey) or not n_prey:
        raise ValueError(_expected("captured, bool", (*shape, "n_prey"), captured))
    if fitness.dtype.kind not in "fiu" or fitness.ndim != 3 or fitness.shape[:2] != shape or fitness.shape[2] <= n_prey:
        raise ValueError(_expected("fitness, float", (*shape, "n_agents"), fitness))
    result = replace(result, fitness=fitness.astype(np.float64, copy=False), captured=captured)
    for role in ROLES:
        own = result.fitness_of(role)
        wrong = np.argwhere(~(np.abs(own) <= _MOST))
        if len(wrong):
            trial, episode, agent = wrong[0].tolist()
            whose = f"agent {agent} of the {role} in trial {trial}, episode {episode}"
            raise ValueError(f"fitness must be finite, got {own[trial, episode, agent]} for {whose}")
    return result


def _expected(what: str, shape: tuple[object, ...], got: np.ndarray) -> str:
    wanted = f"{what} of shape ({', '.join(map(str, shape))})"
    return f"the evaluator must return {wanted}, got {got.dtype} of shape {got.shape}"
