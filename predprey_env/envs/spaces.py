"""The spaces of observations, actions and states."""

from __future__ import annotations

import numpy as np
from gymnasium.spaces import Box, Discrete

from predprey_env.config import EnvConfig, TeamName


def observation_space(config: EnvConfig, team: TeamName) -> Box:
    """Return the space of an agent's observation: an offset ``(x, y)`` for each opponent, in cells."""
    low, high = -(config.size // 2), config.size - config.size // 2 - 1
    return Box(low, high, (config.team(team).n_seen,), np.float32)


def action_space(config: EnvConfig, team: TeamName) -> Discrete:
    """Return the space of an agent's actions; they are named in :data:`predprey_env.config.MOVES`."""
    return Discrete(config.team(team).n_actions)


def state_space(config: EnvConfig) -> Box:
    """Return the space of the state: all columns, all rows, which prey are free, and the fraction of the time limit
    that has passed.
    """
    top = np.array([config.size - 1] * (2 * config.n_agents) + [1] * (config.n_prey + 1), np.float32)
    return Box(np.zeros_like(top), top, dtype=np.float32)
