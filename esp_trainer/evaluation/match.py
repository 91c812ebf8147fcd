"""Matches between two teams."""

from __future__ import annotations

from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.seeding import stream
from esp_trainer.statistics import Captures, count_captures
from esp_trainer.types import ROLES, Contestant, TrialBatch
from predprey_env.config import EnvConfig


def match(predators: Contestant, prey: Contestant, env: EnvConfig, n_episodes: int, seed: int = 0) -> Captures:
    """Play two teams against each other, from random starts with the parities in their true proportions.

    Raises :class:`ValueError` if a team does not fit the world or its role.
    """
    evaluator = FusedEvaluator(env)
    starts = evaluator.starts.held_out(stream(seed, "match"), n_episodes)
    for role, player in zip(ROLES, (predators, prey), strict=True):
        player.check_fits(role, env)
    batch = TrialBatch(predators.as_teams(n_episodes), prey.as_teams(n_episodes), starts)
    return count_captures(evaluator.evaluate(batch), evaluator.starts.even_predators(starts), env.n_predators)
