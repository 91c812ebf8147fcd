"""Results of a step of many worlds: rewards, flags and infos of a team."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from predprey_env.config import Rules
from predprey_env.engine import TeamRows, measure
from predprey_env.envs.worlds import Scratch, Worlds, block_at
from predprey_env.jit.compilation import entry_point
from predprey_env.jit.lanes import LANES
from predprey_env.jit.values import Array
from predprey_env.rules.dynamics import count_alive


class Results(NamedTuple):
    """Results of a step for each agent of the team: ``(n_worlds, n_agents)``."""

    rewards: Array
    """Reward: float64."""
    terminated: Array
    """True if all prey are caught: bool."""
    truncated: Array
    """True if the time is up and some prey are free: bool."""


class Counts(NamedTuple):
    """Infos of each agent of the team: int64 ``(n_worlds, n_agents)``."""

    captured: Array
    """1 for a caught prey, else 0."""
    n_captured: Array
    """Number of prey caught in the world."""
    steps: Array
    """Number of time steps begun."""


def make_results(n_worlds: int, team: TeamRows) -> Results:
    """Return the arrays for the results of a step."""
    return Results(*(np.zeros((n_worlds, team.n_agents), kind) for kind in (np.float64, np.bool_, np.bool_)))


def make_counts(n_worlds: int, team: TeamRows) -> Counts:
    """Return the arrays for the infos."""
    return Counts(*np.zeros((3, n_worlds, team.n_agents), np.int64))


@entry_point
def judge(
    worlds: Worlds, team: TeamRows, rules: Rules, dense: bool, scratch: Scratch, scores: Array, results: Results
) -> None:
    """Write the rewards and flags of a step to ``results``.

    ``scores`` holds the fitness before the step. It is updated where a reward depends on it: in worlds that are over,
    and in all worlds if rewards are dense.
    """
    for world in range(len(scores)):
        at, lane = world // LANES, world % LANES
        over = worlds.over[at, 0, lane] != 0
        for agent in range(team.n_agents):
            results.rewards[world, agent] = -scores[world, team.first + agent] if dense else 0.0
        caught_all = False
        if dense or over:
            measure(block_at(worlds, at), lane, rules, scratch.one, scores[world])
            caught_all = count_alive(scratch.one, rules) == 0
            for agent in range(team.n_agents):
                results.rewards[world, agent] += scores[world, team.first + agent]
        for agent in range(team.n_agents):
            results.terminated[world, agent] = over and caught_all
            results.truncated[world, agent] = over and not caught_all


@entry_point
def count(worlds: Worlds, team: TeamRows, rules: Rules, counts: Counts) -> None:
    """Write to ``counts`` which agents are caught, how many prey are caught, and how many steps have begun."""
    for world in range(len(counts.steps)):
        at, lane = world // LANES, world % LANES
        alive = worlds.blocks.world.alive[at]
        n_captured, begun = rules.n_prey, worlds.blocks.clock[at, 0, lane]
        if rules.prey_first and team.first == 0 and worlds.over[at, 0, lane] == 0:
            begun += 1  # the prey have already moved in the next step
        for prey in range(rules.n_prey):
            n_captured -= alive[prey, lane]
        for agent in range(team.n_agents):
            counts.captured[world, agent] = team.first > 0 and alive[agent, lane] == 0
            counts.n_captured[world, agent] = n_captured
            counts.steps[world, agent] = begun
