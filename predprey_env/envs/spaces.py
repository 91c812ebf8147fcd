"""The spaces of observations, actions and states."""

from __future__ import annotations

from itertools import accumulate

import numpy as np
from gymnasium.spaces import Box, Discrete

from predprey_env.config import TEAMS, EnvConfig, Sight, TeamName


def observation_space(config: EnvConfig, team: TeamName) -> Box:
    """Return the space of an agent's observation: offsets first, then last moves and the identity if they are seen."""
    shape, sight = config.team(team), config.sight
    n_offsets = 2 * sight.n_others(shape.n_agents, shape.n_opponents)
    n_moves = n_offsets if sight.moves else 0
    lengths = n_offsets, n_moves, shape.n_seen - n_offsets - n_moves
    half = config.size // 2
    lowest, highest = np.array([-half, config.size - half - 1], np.float32)
    if sight.scaled:
        scale = np.float32(2) / np.float32(config.size)
        lowest, highest = lowest * scale, highest * scale
    low, high = np.repeat([lowest, -1, 0], lengths), np.repeat([highest, 1, 1], lengths)
    return Box(low.astype(np.float32), high.astype(np.float32), dtype=np.float32)


def observation_slices(config: EnvConfig, sight: Sight) -> list[slice]:
    """Return where each agent's observation is among those of all agents."""
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
