"""One team in many episodes of a game at once: what its agents see, remember and do.

The networks of all episodes choose in one compiled call, by the same rule as in all other evaluators.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from esp_trainer.arrays import BoolMask
from esp_trainer.esp.network import Networks
from esp_trainer.esp.team import gather_genomes
from esp_trainer.game import GameError
from esp_trainer.networks.controller import Controller
from esp_trainer.types import EvolvedTeams, Role, ScriptedTeams, TeamBatch
from predprey_env.arrays import Actions, Observation, Observations
from predprey_env.config import TeamShape
from predprey_env.jit.compilation import entry_point
from predprey_env.jit.values import FloatRows
from predprey_env.policies.protocol import choose, first_memory, memory_rows
from predprey_env.policies.scripted import NUMBERS, Script


class Squad(NamedTuple):
    """The teams of one side in some trials, as plain arrays that other processes can be sent."""

    controller: Controller | None
    """None for the random script."""
    weights: np.ndarray
    """Genes of the team of each trial, float32 ``(n_trials, n_weights)``."""

    @classmethod
    def of(cls, role: Role, teams: TeamBatch, n_trials: int, shape: TeamShape) -> Squad:
        """Return the teams of a batch; raise :class:`ValueError` if they do not fit the game."""
        if isinstance(teams, ScriptedTeams):
            if teams.script != "random":
                raise ValueError(f"{role} must be evolved or random in another game, got {teams.script}")
            return cls(None, np.zeros((n_trials, 0), np.float32))
        if not isinstance(teams, EvolvedTeams):
            raise TypeError(f"teams must be EvolvedTeams or ScriptedTeams, got {type(teams).__name__}")
        controller = teams.controller
        got = len(teams.indices), teams.indices.shape[1], controller.n_actions
        expected = n_trials, shape.n_agents, shape.n_actions
        if got != expected or controller.n_together > 1 or controller.n_seen > shape.n_seen:
            raise ValueError(
                "{} must have {} trials, {} agents and {} actions, got {}, {} and {}".format(role, *expected, *got)
            )
        genomes = gather_genomes(teams, np.arange(n_trials))
        return cls(
            controller, np.ascontiguousarray(genomes, np.float32).reshape(n_trials, int(np.prod(genomes.shape[1:])))
        )

    def part(self, trials: slice) -> Squad:
        """Return the teams of some trials."""
        return Squad(self.controller, self.weights[trials])


@entry_point
def _choose_networks(
    controller: Controller,
    weights: np.ndarray,
    inputs: FloatRows,
    votes: FloatRows,
    seen: Observation,
    memory: np.ndarray,
    acts: BoolMask,
    actions: Actions,
) -> None:
    for world in range(len(actions)):
        networks = Networks(controller, weights[world], inputs, votes)
        for agent in range(actions.shape[1]):
            if acts[world, agent]:
                actions[world, agent] = choose(networks, agent, seen[world, agent], memory[world, agent], 0)


@entry_point
def _choose_script(script: Script, seen: Observation, memory: np.ndarray, acts: BoolMask, actions: Actions) -> None:
    for world in range(len(actions)):
        for agent in range(actions.shape[1]):
            if acts[world, agent]:
                actions[world, agent] = choose(script, agent, seen[world, agent], memory[world, agent], 0)


@entry_point
def _remember(memory: np.ndarray, seed: int, prey: bool) -> None:
    for agent in range(len(memory)):
        for row in range(memory.shape[1]):
            memory[agent, row] = first_memory(seed, prey, agent, row)


class Seats:
    """One team in all copies of the environment: what its agents see, remember and do."""

    def __init__(self, role: Role, squad: Squad, names: Sequence[str], shape: TeamShape, n_copies: int) -> None:
        self.names, self._shape, self._squad, self._prey = names, shape, squad, role == "prey"
        self._weights = np.zeros((n_copies, squad.weights.shape[1]), np.float32)
        self._seen = np.zeros((n_copies, shape.n_agents, shape.n_seen), np.float32)
        self._acts = np.zeros((n_copies, shape.n_agents), np.bool_)
        self._actions = np.zeros((n_copies, shape.n_agents), np.int64)
        if squad.controller is None:
            self._player: Any = Script(NUMBERS["random"], shape.n_opponents, shape.n_actions)
        else:
            inputs = np.zeros(max(squad.controller.fan_in) + 1, np.float32)
            self._player = Networks(
                squad.controller, np.zeros(0, np.float32), inputs, np.zeros(squad.controller.n_votes, np.float32)
            )
        self._memory = np.zeros((n_copies, shape.n_agents, memory_rows(self._player)), np.int32)

    def begin(self, copy: int, trial: int, seed: int) -> None:
        """Seat the team of a trial in a copy, for an episode."""
        self._weights[copy] = self._squad.weights[trial]
        _remember(self._memory[copy], seed % 2**31, self._prey)

    def look(self, copy: int, observations: Observations, agents: Sequence[str]) -> None:
        """Note what the agents of a copy observe. Those that have left, or observe nothing, do not act."""
        for number, name in enumerate(self.names):
            self._acts[copy, number] = name in observations and name in agents
            if self._acts[copy, number]:
                seen = observations[name]
                if np.shape(seen) != (self._shape.n_seen,):
                    raise GameError(f"{name} must observe {self._shape.n_seen} numbers, got shape {np.shape(seen)}")
                self._seen[copy, number] = seen

    def look_at_all(self, observations: Mapping[str, Observation], playing: BoolMask) -> None:
        """Note what the agents of all copies observe. Those whose episode is over do not act."""
        self._acts[:] = playing[:, None]
        for number, name in enumerate(self.names):
            seen, expected = np.asarray(observations[name]), (len(playing), self._shape.n_seen)
            if seen.shape != expected:
                raise GameError(f"{name} must observe numbers of shape {expected}, got {seen.shape}")
            self._seen[:, number] = seen

    def actions_of_all(self) -> dict[str, Actions]:
        """Return the actions of each agent in all copies, int64 ``(n_copies,)``."""
        return {name: self._actions[:, number].copy() for number, name in enumerate(self.names)}

    def leave(self, copy: int) -> None:
        """Let no agent act in a copy."""
        self._acts[copy] = False

    def choose(self) -> None:
        """Choose the actions of all agents in all copies."""
        rest = self._seen, self._memory, self._acts, self._actions
        if isinstance(self._player, Script):
            _choose_script(self._player, *rest)
        else:
            _choose_networks(self._player.controller, self._weights, self._player.inputs, self._player.votes, *rest)

    def actions(self, copy: int) -> dict[str, int]:
        """Return the actions of the agents that act in a copy."""
        acts, chosen = self._acts[copy].tolist(), self._actions[copy].tolist()
        return {name: action for name, action, does in zip(self.names, chosen, acts, strict=True) if does}
