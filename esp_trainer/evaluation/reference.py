"""Reference evaluator: policies act in an environment, one step at a time, through PettingZoo's public API.

The compiled evaluator is tested against it. It also plays any other parallel environment with discrete actions: give it
the environment, a source of episode starts, the name prefixes of the two teams, and controllers wired to the
environment's observations.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, Protocol

import numpy as np
from pettingzoo import ParallelEnv

from esp_trainer.arrays import EpisodeStarts
from esp_trainer.config import SideConfig
from esp_trainer.esp.team import Team, gather_genomes
from esp_trainer.evaluation.starts import CellStarts
from esp_trainer.types import (
    ROLES,
    EvolvedTeams,
    Role,
    ScriptedTeams,
    Starts,
    TeamBatch,
    TrialBatch,
    TrialResult,
    zero_sum_part,
)
from predprey_env import PredPreyEnv
from predprey_env.arrays import Observation
from predprey_env.config import EnvConfig
from predprey_env.envs.team import observed_by
from predprey_env.policies import Policy, ScriptedTeam


class ResettableStarts(Starts, Protocol):
    """Starts that an environment can be reset to."""

    def reset_arguments(self, start: EpisodeStarts) -> dict[str, Any]:
        """Return the arguments of ``reset`` for a start."""
        ...

    def policy_seed(self, start: EpisodeStarts) -> int:
        """Return the seed with which both teams are reset in an episode from a start."""
        ...


class ReferenceEvaluator:
    """Plays batches through the PettingZoo API. An agent's fitness is its undiscounted return.

    Captures and lengths in time steps are read from the infos ``captured`` and ``steps``. If an environment has none,
    no agent counts as captured, and the length is the number of calls of ``step``.

    Args:
        make_env: Function that returns the environment. Its agents' names end in numbers, which count from 0 in each
            team.
        starts: Source of the episode starts.
        teams: Name prefixes of the predators and of the prey.
    """

    def __init__(
        self,
        make_env: Callable[[], ParallelEnv[str, Observation, int]],
        starts: ResettableStarts,
        teams: tuple[str, str] = ("predator_", "prey_"),
    ) -> None:
        self.env = make_env()
        self.starts = starts
        self.agents = {
            role: [agent for agent in self.env.possible_agents if agent.startswith(prefix)]
            for role, prefix in zip(ROLES, teams, strict=True)
        }
        for role, prefix in zip(ROLES, teams, strict=True):
            if not self.agents[role]:
                raise ValueError(f"no agent's name begins with {prefix!r}; there are {self.env.possible_agents}")

    def evaluate(self, batch: TrialBatch) -> TrialResult:
        """Play every episode of every trial."""
        everybody = self.agents["predators"] + self.agents["prey"]
        n_trials, n_episodes = batch.starts.shape[:2]
        result = TrialResult(
            fitness=np.zeros((n_trials, n_episodes, len(everybody))),
            captured=np.zeros((n_trials, n_episodes, len(self.agents["prey"])), np.bool_),
            steps=np.zeros((n_trials, n_episodes), np.int64),
        )
        for trial in range(n_trials):
            policies = {role: self._policy(role, getattr(batch, role), trial) for role in ROLES}
            for episode in range(n_episodes):
                steps_of_episode = self.play(policies, batch.starts[trial, episode])
                for call, (rewards, infos) in enumerate(steps_of_episode, start=1):
                    result.fitness[trial, episode] += [rewards.get(agent, 0.0) for agent in everybody]
                    caught = [infos.get(agent, {}).get("captured", 0) for agent in self.agents["prey"]]
                    result.captured[trial, episode] |= np.array(caught, bool)
                    steps = [info["steps"] for info in infos.values() if "steps" in info]
                    result.steps[trial, episode] = max(steps, default=call)
        if isinstance(self.env, PredPreyEnv):
            return result
        return replace(result, returned=zero_sum_part(result.fitness, len(self.agents["predators"])))

    def play(
        self, policies: dict[Role, Policy], start: EpisodeStarts
    ) -> Iterator[tuple[dict[str, float], dict[str, dict[str, Any]]]]:
        """Play one episode. Yield the rewards and the infos of all agents after each step."""
        observations, infos = self.env.reset(**self.starts.reset_arguments(start))
        for policy in policies.values():
            policy.reset(self.starts.policy_seed(start))
        while self.env.agents:
            actions: dict[str, int] = {}
            for role, policy in policies.items():
                # An agent that has left may still be in the last observations.
                there = [agent for agent in self.agents[role] if agent in self.env.agents]
                in_turn = [agent for agent in there if infos.get(agent, {}).get("in_turn", agent in observations)]
                seen = observed_by(policy, self.env, observations)
                actions |= policy.act({agent: seen[agent] for agent in in_turn})
            observations, rewards, _, _, infos = self.env.step(actions)
            yield rewards, infos

    def _policy(self, role: Role, teams: TeamBatch, trial: int) -> Policy:
        match teams:
            case EvolvedTeams():
                return team_of_trial(role, teams, trial)
            case ScriptedTeams() if isinstance(self.env, PredPreyEnv):
                return teams.policy(role, self.env.config)
            case ScriptedTeams():
                return ScriptedTeam(teams.script, role, int(self.env.action_space(self.agents[role][0]).n))
        raise TypeError(f"teams must be EvolvedTeams or ScriptedTeams, got {type(teams).__name__}")


def team_of_trial(role: Role, teams: EvolvedTeams, trial: int) -> Team:
    """Return the team of one trial as a policy."""
    genomes = gather_genomes(teams, np.array([trial]))[0]
    return Team(role, SideConfig(), teams.controller, genomes)


def predprey_reference(config: EnvConfig) -> ReferenceEvaluator:
    """Return the reference evaluator of the predator-prey world.

    Its returns equal the fitness only if rewards are terminal and caught prey stay, so it sets both options.
    """
    world = config.replace(reward="terminal", captured_prey="inert")
    return ReferenceEvaluator(lambda: PredPreyEnv(world), CellStarts(world))
