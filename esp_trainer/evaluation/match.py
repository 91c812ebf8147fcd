"""Matches between two teams."""

from __future__ import annotations

from typing import TypeAlias

from esp_trainer.esp.team import Team
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.seeding import stream
from esp_trainer.statistics import Captures, count_captures
from esp_trainer.types import Role, ScriptedTeams, Teams, TrialBatch
from predprey_env.config import EnvConfig

Contestant: TypeAlias = Team | ScriptedTeams


def match(predators: Contestant, prey: Contestant, env: EnvConfig, n_episodes: int, seed: int = 0) -> Captures:
    """Play two teams against each other, from random starts with the parities in their true proportions.

    Raises :class:`ValueError` if a team does not fit the world or its role.
    """
    evaluator = FusedEvaluator(env)
    starts = evaluator.starts.held_out(stream(seed, "match"), n_episodes)
    batch = TrialBatch(_entry(predators, "predators", env, n_episodes), _entry(prey, "prey", env, n_episodes), starts)
    return count_captures(evaluator.evaluate(batch), evaluator.starts.even_predators(starts), env.n_predators)


def _entry(player: Contestant, role: Role, env: EnvConfig, n_trials: int) -> Teams:
    if isinstance(player, ScriptedTeams):
        return player
    player.check_fits(role, env)
    return player.as_teams(n_trials)
