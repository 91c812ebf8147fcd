"""Matches of a candidate against one opponent: teams, scripts and any policies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from gymnasium.vector import AutoresetMode

from esp_trainer.arrays import Counts, Fitness, Steps
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.seeding import stream
from esp_trainer.types import ROLES, Contestant, PolicyError, Role, ScriptedTeams, TrialBatch
from predprey_env.agents import other_team
from predprey_env.config import EnvConfig
from predprey_env.envs.vector import PredPreyVectorEnv
from predprey_env.policies import Policy
from predprey_env.policies.opponents import as_policy, sight_in
from predprey_env.policies.outside import OutsideTeam
from predprey_env.settings import brief
from predprey_env.sight import options_of

Challenger: TypeAlias = Contestant | Policy


@dataclass(frozen=True)
class Meeting:
    """Results of a candidate against one opponent, one entry for each episode."""

    captured: Counts
    """Number of prey caught, int ``(n_episodes,)``."""
    fitness: Fitness
    """Fitness of the candidate, mean over its agents, float64 ``(n_episodes,)``."""
    steps: Steps
    """Length in time steps, int ``(n_episodes,)``."""


class Arena:
    """Plays a candidate against its opponents, all from the same starts.

    Args:
        env: The world.
        n_episodes: Number of episodes against each opponent.
        seed: Seed of the starts, and of all randomness in the players.
    """

    def __init__(self, env: EnvConfig, n_episodes: int, seed: int) -> None:
        if not isinstance(env, EnvConfig):
            raise TypeError(f"env must be an EnvConfig, got {brief(env)}")
        if n_episodes < 1:
            raise ValueError(f"n_episodes must be at least 1, got {n_episodes}")
        self.env = env
        self.seed = seed
        self.evaluator = FusedEvaluator(env)
        self.starts = self.evaluator.starts.held_out(stream(seed, "gauntlet"), n_episodes)

    def meet(self, candidate: Challenger, role: Role, opponent: Challenger | str) -> Meeting:
        """Play all episodes: compiled if both players are teams or scripts of this package, else in the vector
        environment. The opponent may be the name of a script.

        Raises :class:`ValueError` if a player cannot play its team in this world, and :class:`PolicyError` if a policy
        raises, or does not return an action for each agent.
        """
        if role not in ROLES:
            raise ValueError(f"role must be {' or '.join(ROLES)}, got {brief(role)}")
        if isinstance(opponent, str):
            opponent = ScriptedTeams(opponent)
        for player, team in ((candidate, role), (opponent, other_team(role))):
            if isinstance(player, Contestant):
                player.check_fits(team, self.env)
        if isinstance(candidate, Contestant) and isinstance(opponent, Contestant):
            return self._play_compiled(candidate, role, opponent)
        policies = self._policy(candidate, role, "candidate"), self._policy(opponent, other_team(role), "opponent")
        return self._play_outside(policies[0], role, policies[1])

    def _policy(self, player: Challenger, role: Role, named: str) -> Policy:
        if isinstance(player, Contestant):
            return player.policy(role, self.env)
        return as_policy(player, role, self.env, named)

    def _play_compiled(self, candidate: Contestant, role: Role, opponent: Contestant) -> Meeting:
        teams = {role: candidate.as_teams(len(self.starts)), other_team(role): opponent.as_teams(len(self.starts))}
        result = self.evaluator.evaluate(TrialBatch(**teams, starts=self.starts))
        captured, fitness = result.captured[:, 0].sum(axis=1), result.fitness_of(role)[:, 0].mean(axis=1)
        return Meeting(captured, fitness, result.steps[:, 0])

    def _play_outside(self, candidate: Policy, role: Role, opponent: Policy) -> Meeting:
        n = len(self.starts)
        env = self.env.replace(reward="terminal", **options_of(sight_in(candidate, self.env)))
        try:
            worlds = PredPreyVectorEnv(env, n, role, opponent, AutoresetMode.SAME_STEP)
            views, _ = worlds.reset(seed=self.seed, options={"starts": self.starts[:, 0]})
        except (RuntimeError, ValueError) as error:
            raise PolicyError(str(error)) from error
        team = self._begin(candidate, role)
        found = Meeting(np.zeros(n, np.int64), np.zeros(n), np.zeros(n, np.int64))
        playing = np.ones(n, np.bool_)
        while playing.any():  # worlds whose episode is over restart by themselves, and are ignored
            team.views[:] = views.reshape(team.views.shape)
            try:
                actions = team.act(playing)
                views, rewards, terminated, truncated, infos = worlds.step(actions.ravel())
            except (RuntimeError, ValueError) as error:
                raise PolicyError(str(error)) from error
            over = playing & (terminated | truncated).reshape(n, -1)[:, 0]
            if over.any():
                last = {name: infos["final_info"][name].reshape(n, -1)[over, 0] for name in ("n_captured", "steps")}
                found.captured[over], found.steps[over] = last["n_captured"], last["steps"]
                found.fitness[over] = rewards.reshape(n, -1)[over].mean(axis=1)
                playing &= ~over
        return found

    def _begin(self, candidate: Policy, role: Role) -> OutsideTeam:
        n = len(self.starts)
        try:
            team = OutsideTeam(candidate, self.env, role, n, whose="the policy's")
        except ValueError as error:
            raise PolicyError(str(error)) from error
        try:
            team.reset(np.arange(n), stream(self.seed, "candidate").integers(2**31, size=n))
        except (Exception, SystemExit) as error:
            raise PolicyError(f"the policy's reset() raised {type(error).__name__}: {error}") from error
        return team
