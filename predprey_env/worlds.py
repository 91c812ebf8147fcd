"""Many worlds side by side: one team of each is played from outside, the other by a player in compiled code.

The worlds are laid out in blocks of ``LANES`` and moved by the rules that move a single world: equal starts and equal
actions lead to equal episodes, to the bit. A world that is over does not start again until :func:`place` is called.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from predprey_env.compilation import entry_point, rule
from predprey_env.config import IDLE, EnvConfig, Rules, TeamName
from predprey_env.dynamics import World, count_alive, is_over, predators_turn, prey_turn, step
from predprey_env.fitness import fitness
from predprey_env.lanes import LANES, lane_zeros, load, store, where
from predprey_env.observation import observe
from predprey_env.policies.protocol import MEMORY, choose, first_memory


class Team(NamedTuple):
    """Rows of a world that belong to one team."""

    first: int
    n_agents: int


class Worlds(NamedTuple):
    """State of all worlds: int32 ``(n_blocks, rows, LANES)``."""

    x: Any
    y: Any
    alive: Any
    clock: Any
    """Number of time steps played."""
    actions: Any
    kept: Any
    """Memory of the opponents: ``MEMORY`` rows for each of them."""
    over: Any
    """1 where the episode is over, else 0; there the opponents no longer choose, and stay where they are."""


class Scratch(NamedTuple):
    """Scratch memory of the kernels."""

    seen: Any
    """float32 ``(rows, LANES)``."""
    kept: Any
    """int32 ``(rows, LANES)``."""
    one: World
    """A single world, for computing the fitness."""


class Results(NamedTuple):
    """Results of a step for each agent of the team: ``(n_worlds, n_agents)``."""

    rewards: Any
    """Reward: float64."""
    terminated: Any
    """True if all prey are caught: bool."""
    truncated: Any
    """True if the time is up and some prey are free: bool."""


class Counts(NamedTuple):
    """Infos of each agent of the team: int64 ``(n_worlds, n_agents)``."""

    captured: Any
    """1 for a caught prey, else 0."""
    n_captured: Any
    """Number of prey caught in the world."""
    steps: Any
    """Number of time steps begun."""


class Dictated(NamedTuple):
    """A player whose actions were chosen in Python and written to the rows where another player keeps its memory."""


@rule
def _obey(player: Dictated, agent: int, seen: Any, memory: Any, at: int) -> Any:  # noqa: ARG001 - choose() passes all
    return load(memory, at)


choose.register(Dictated, _obey)


def team_rows(config: EnvConfig, name: TeamName) -> Team:
    """Return the rows of a team's agents."""
    return Team(0 if name == "predators" else config.n_predators, config.team(name).n_agents)


def make_worlds(config: EnvConfig, n_worlds: int, opponents: Team) -> Worlds:
    """Return the memory for ``n_worlds`` worlds; the unused lanes of the last block are computed but never read."""
    n_blocks, n_agents = -(-n_worlds // LANES), config.n_agents
    rows = (n_agents, n_agents, config.n_prey, 1, n_agents, opponents.n_agents * MEMORY, 1)
    return Worlds(*(lane_zeros(np.int32, n_blocks, n) for n in rows))


def make_scratch(config: EnvConfig, opponents: Team) -> Scratch:
    """Return scratch memory for the kernels."""
    n = config.n_agents
    one = World(np.zeros(n, np.int32), np.zeros(n, np.int32), np.zeros(config.n_prey, np.int32))
    seen, kept = lane_zeros(np.float32, 2 * n), lane_zeros(np.int32, opponents.n_agents * MEMORY)
    return Scratch(seen, kept, one)


def make_results(n_worlds: int, team: Team) -> Results:
    """Return the arrays for the results of a step."""
    return Results(*(np.zeros((n_worlds, team.n_agents), kind) for kind in (np.float64, np.bool_, np.bool_)))


def make_counts(n_worlds: int, team: Team) -> Counts:
    """Return the arrays for the infos."""
    return Counts(*np.zeros((3, n_worlds, team.n_agents), np.int64))


# -- a block of worlds --------------------------------------------------------------------------------------------


@rule
def _world(worlds: Worlds, block: int) -> World:
    return World(worlds.x[block], worlds.y[block], worlds.alive[block])


@rule
def _tick(worlds: Worlds, block: int, rules: Rules) -> None:
    """Count a time step that has been played, and mark the worlds that are over."""
    steps = load(worlds.clock[block], 0) + 1
    store(worlds.clock[block], 0, steps)
    store(worlds.over[block], 0, where(is_over(_world(worlds, block), steps, rules), 1, 0))


@rule
def _move(worlds: Worlds, block: int, movers: Team, rules: Rules) -> None:
    """Play a team's turn; the predators' turn ends the time step."""
    if movers.first == 0:
        predators_turn(_world(worlds, block), worlds.actions[block], rules)
        _tick(worlds, block, rules)
    else:
        prey_turn(_world(worlds, block), worlds.actions[block], rules)


@rule
def _choose(worlds: Worlds, block: int, opponents: Team, player: Any, rules: Rules, scratch: Scratch) -> None:
    """Let every opponent observe and choose; where the episode is over, it keeps its old memory and its cell."""
    kept, over = worlds.kept[block], load(worlds.over[block], 0) != 0
    # A rule cannot skip single lanes: all lanes choose, then the memory of those that are over is restored.
    for row in range(opponents.n_agents * MEMORY):
        store(scratch.kept, row, load(kept, row))
    for agent in range(opponents.n_agents):
        observe(_world(worlds, block), opponents.first + agent, rules, scratch.seen, 0)
        action = choose(player, agent, scratch.seen, kept, agent * MEMORY)
        store(worlds.actions[block], opponents.first + agent, where(over, IDLE, action))
    for row in range(opponents.n_agents * MEMORY):
        store(kept, row, where(over, load(scratch.kept, row), load(kept, row)))


@rule
def _take_out(worlds: Worlds, world: int, one: World) -> None:
    """Copy one world out of its block."""
    block, lane = world // LANES, world % LANES
    for agent in range(len(one.x)):
        one.x[agent] = worlds.x[block, agent, lane]
        one.y[agent] = worlds.y[block, agent, lane]
    for prey in range(len(one.alive)):
        one.alive[prey] = worlds.alive[block, prey, lane]


@rule
def _forget(worlds: Worlds, opponents: Team, block: int, lane: int, seed: int) -> None:
    """Reset the opponents' memory in one world to its state at the start of an episode."""
    for agent in range(opponents.n_agents):
        for row in range(MEMORY):
            first = first_memory(seed, opponents.first > 0, agent, row)
            worlds.kept[block, agent * MEMORY + row, lane] = first


# -- what Python calls --------------------------------------------------------------------------------------------


@entry_point
def place(worlds: Worlds, opponents: Team, rules: Rules, which: Any, starts: Any, seeds: Any) -> None:
    """Start an episode in the worlds ``which``, int64 ``(n,)``, from cells int32 ``(n, n_agents, 2)``.

    The random choices of the opponents follow from ``seeds``, int64 ``(n,)``.
    """
    for i in range(len(which)):
        block, lane = which[i] // LANES, which[i] % LANES
        for agent in range(starts.shape[1]):
            worlds.x[block, agent, lane] = starts[i, agent, 0]
            worlds.y[block, agent, lane] = starts[i, agent, 1]
        for prey in range(rules.n_prey):
            worlds.alive[block, prey, lane] = 1
        _forget(worlds, opponents, block, lane, seeds[i])
        worlds.clock[block, 0, lane] = 0
        worlds.over[block, 0, lane] = 0


@entry_point
def forget(worlds: Worlds, opponents: Team, seeds: Any) -> None:
    """Reset the opponents' memory in all worlds to its state at the start of an episode, from ``seeds``, int64
    ``(n_worlds,)``.
    """
    for world in range(len(seeds)):
        _forget(worlds, opponents, world // LANES, world % LANES, seeds[world])


@entry_point
def move_team(worlds: Worlds, team: Team, rules: Rules, actions: Any) -> None:
    """Store the team's actions, int32 ``(n_worlds, n_agents)``, and play them if teams move in turns."""
    for block in range(len(worlds.x)):
        for lane in range(min(LANES, len(actions) - block * LANES)):
            for agent in range(team.n_agents):
                worlds.actions[block, team.first + agent, lane] = actions[block * LANES + lane, agent]
        if rules.prey_first:
            _move(worlds, block, team, rules)


@entry_point
def move_opponents(worlds: Worlds, opponents: Team, player: Any, rules: Rules, scratch: Scratch) -> None:
    """Let the opponents choose and play their actions: together with the team, or in a turn of their own."""
    for block in range(len(worlds.x)):
        _choose(worlds, block, opponents, player, rules, scratch)
        if rules.prey_first:
            _move(worlds, block, opponents, rules)
        else:
            step(_world(worlds, block), worlds.actions[block], rules)
            _tick(worlds, block, rules)


@entry_point
def look(worlds: Worlds, team: Team, rules: Rules, scratch: Scratch, views: Any) -> None:
    """Write the observations of every agent of a team to ``views``, float32 ``(n_worlds, n_agents, n_seen)``."""
    for block in range(len(worlds.x)):
        for agent in range(team.n_agents):
            n_seen = observe(_world(worlds, block), team.first + agent, rules, scratch.seen, 0)
            for lane in range(min(LANES, len(views) - block * LANES)):
                for i in range(n_seen):
                    views[block * LANES + lane, agent, i] = scratch.seen[i, lane]


@entry_point
def score(worlds: Worlds, rules: Rules, scratch: Scratch, which: Any, scores: Any) -> None:
    """Write every agent's fitness in the worlds ``which``, as if the episode ended now, to ``scores``.

    ``scores`` is float64 ``(n_worlds, n_agents)``.
    """
    for world in which:
        _take_out(worlds, world, scratch.one)
        fitness(scratch.one, worlds.clock[world // LANES, 0, world % LANES], rules, scores[world])


@entry_point
def judge(
    worlds: Worlds, team: Team, rules: Rules, dense: bool, scratch: Scratch, scores: Any, results: Results
) -> None:
    """Write the rewards and flags of a step to ``results``.

    ``scores`` holds the fitness from before the step. It is updated where it counts: in worlds that are over, and in
    all worlds if rewards are dense.
    """
    for world in range(len(scores)):
        steps, over = worlds.clock[world // LANES, 0, world % LANES], worlds.over[world // LANES, 0, world % LANES] != 0
        caught_all = False
        if dense or over:
            _take_out(worlds, world, scratch.one)
            caught_all = count_alive(scratch.one, rules) == 0
        for agent in range(team.n_agents):
            results.rewards[world, agent] = -scores[world, team.first + agent] if dense else 0.0
            results.terminated[world, agent] = over and caught_all
            results.truncated[world, agent] = over and not caught_all
        if dense or over:
            fitness(scratch.one, steps, rules, scores[world])
            for agent in range(team.n_agents):
                results.rewards[world, agent] += scores[world, team.first + agent]


@entry_point
def count(worlds: Worlds, team: Team, rules: Rules, counts: Counts) -> None:
    """Write to ``counts`` which agents are caught, how many prey are, and how many steps were begun."""
    for world in range(len(counts.steps)):
        block, lane = world // LANES, world % LANES
        n_captured, begun = rules.n_prey, worlds.clock[block, 0, lane]
        if rules.prey_first and team.first == 0 and worlds.over[block, 0, lane] == 0:
            begun += 1  # the prey have already moved in the next step
        for prey in range(rules.n_prey):
            n_captured -= worlds.alive[block, prey, lane]
        for agent in range(team.n_agents):
            counts.captured[world, agent] = team.first > 0 and worlds.alive[block, agent, lane] == 0
            counts.n_captured[world, agent] = n_captured
            counts.steps[world, agent] = begun
