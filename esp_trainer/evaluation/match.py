"""Two teams against each other."""

from __future__ import annotations

from typing import TypeAlias

from esp_trainer.esp.team import Team
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.seeding import stream
from esp_trainer.statistics import Captures, count_captures
from esp_trainer.types import Role, ScriptedTeams, Teams, TrialBatch
from predprey_env.config import EnvConfig

Player: TypeAlias = Team | ScriptedTeams


def match(predators: Player, prey: Player, env: EnvConfig, n_episodes: int, seed: int = 0) -> Captures:
    """How they do from random starts that hold the parities in their true proportions.

    Raises :class:`ValueError` if a team does not fit the world or its role.
    """
    evaluator = FusedEvaluator(env)
    starts = evaluator.starts.held_out(stream(seed, "match"), n_episodes)
    batch = TrialBatch(_entry(predators, "predators", env, n_episodes), _entry(prey, "prey", env, n_episodes), starts)
    return count_captures(evaluator.evaluate(batch), evaluator.starts.even_predators(starts), env.n_predators)


def _entry(player: Player, role: Role, env: EnvConfig, n_trials: int) -> Teams:
    if isinstance(player, ScriptedTeams):
        return player
    check_fits(player, role, env)
    return player.as_teams(n_trials)


def check_fits(team: Team, role: Role, env: EnvConfig) -> None:
    """Raise :class:`ValueError` unless a team can play a role in a world."""
    if team.role != role:
        raise ValueError(f"expected {role}, got a team of {team.role}")
    own, opposing, n_actions = env.n_predators, env.n_prey, env.n_predator_actions
    if role == "prey":
        own, opposing, n_actions = env.n_prey, env.n_predators, env.n_prey_actions
    other = "prey" if role == "predators" else "predators"
    sees = (int(team.controller.wiring.max()) + 1) // 2
    if team.n_agents != own:
        raise ValueError(f"this world has {own} {role}, got a team of {team.n_agents}")
    if sees != opposing:
        raise ValueError(f"this world has {opposing} {other}, got {role} evolved against {sees}")
    if len(team.controller.blank) != n_actions:
        raise ValueError(f"{role} have {n_actions} actions in this world, got a team with {len(team.controller.blank)}")
