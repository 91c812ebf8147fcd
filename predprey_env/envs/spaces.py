"""The spaces of observations, actions and states."""

from __future__ import annotations

from itertools import accumulate

import numpy as np
from gymnasium.spaces import Box, Discrete

from predprey_env.config import TEAMS, EnvConfig, TeamName
from predprey_env.sight import AnySight


class SpacesByAgent:
    """An environment whose agents have spaces of their own."""

    observation_spaces: dict[str, Box]
    action_spaces: dict[str, Discrete]

    def observation_space(self, agent: str) -> Box:
        """Return the agent's observation space, the same object at every call."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Discrete:
        """Return the agent's action space, the same object at every call."""
        return self.action_spaces[agent]


def observation_space(config: EnvConfig, team: TeamName) -> Box:
    """Return the space of an agent's observation."""
    shape = config.team(team)
    low, high = config.sight.bounds(shape.n_agents, shape.n_opponents, config.size)
    low, high = (np.broadcast_to(np.asarray(each, np.float32), shape.n_seen).copy() for each in (low, high))
    return Box(low, high, dtype=np.float32)


def observation_slices(config: EnvConfig, sight: AnySight) -> list[slice]:
    """Return the slice of each agent's observation in the concatenated observations of all agents."""
    shapes = [config.team(team) for team in TEAMS]
    lengths = [n for shape in shapes for n in [sight.n_seen(shape.n_agents, shape.n_opponents)] * shape.n_agents]
    return [slice(end - n, end) for end, n in zip(accumulate(lengths), lengths, strict=True)]


def action_space(config: EnvConfig, team: TeamName) -> Discrete:
    """Return the space of an agent's actions; they are named in :data:`predprey_env.config.MOVES`."""
    return Discrete(config.team(team).n_actions)


def state_space(config: EnvConfig) -> Box:
    """Return the space of the state: all columns, all rows, which prey are free, and the fraction of the time limit
    that has passed.
    """
    top = np.array([config.size - 1] * (2 * config.n_agents) + [1] * (config.n_prey + 1), np.float32)
    return Box(np.zeros_like(top), top, dtype=np.float32)
