"""The block engine: sixteen worlds side by side, in which any two compiled players play each other.

An episode is :func:`begin`, then :func:`play_step` until :func:`~predprey_env.rules.dynamics.is_over`, then
:func:`measure`. The actions of a team that chooses outside compiled code are written to the block; then
:func:`choose_actions` is called only for the other team, before :func:`advance` plays both. The vector environment, the
trainer's evaluator and the page of ``esp-trainer report`` are loops over these functions, so equal starts and equal
actions lead to episodes that are equal to the bit.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from predprey_env.config import IDLE, EnvConfig, Rules, TeamName
from predprey_env.jit.compilation import rule
from predprey_env.jit.lanes import lane_zeros, load, store
from predprey_env.jit.values import Array, FloatRows, IntegerRows
from predprey_env.policies.protocol import MEMORY, Player, choose, first_memory, sees_team, sight_of
from predprey_env.rules.dynamics import EVERYBODY, PREDATORS, PREY, World, remember_moves, take_turn
from predprey_env.rules.fitness import fitness
from predprey_env.rules.observation import observe
from predprey_env.sight import PLAIN_SIGHT, AnySight


class TeamRows(NamedTuple):
    """Rows of a world that belong to one team."""

    first: int
    n_agents: int


class Block(NamedTuple):
    """State of sixteen worlds: int32 arrays ``(rows, LANES)``."""

    world: World
    clock: IntegerRows
    """Number of time steps played: one row."""
    survived: IntegerRows
    """Number of time steps that each prey survived; a caught prey was caught in the next step."""
    actions: IntegerRows
    """Action that each agent has chosen."""
    moved: IntegerRows
    """Last action that each agent has played; idle before its first."""
    memory: IntegerRows
    """Memory of the players: the same number of rows for each agent."""


def team_rows(config: EnvConfig, name: TeamName) -> TeamRows:
    """Return the rows of a team's agents."""
    return TeamRows(0 if name == "predators" else config.n_predators, config.team(name).n_agents)


def make_block(rules: Rules, *shape: int, n_memory: int = MEMORY) -> Block:
    """Allocate a block, or an array of blocks with the leading ``shape``.

    Each agent gets ``n_memory`` rows of memory: the largest :data:`~predprey_env.policies.memory_rows` of the players.
    """
    n_prey, n_agents = rules.n_prey, rules.n_predators + rules.n_prey
    x, y, alive, clock, survived, actions, moved, memory = (
        lane_zeros(np.int32, *shape, rows)
        for rows in (n_agents, n_agents, n_prey, 1, n_prey, n_agents, n_agents, n_agents * n_memory)
    )
    return Block(World(x, y, alive), clock, survived, actions, moved, memory)


def seen_rows(rules: Rules, *sights: AnySight) -> int:
    """Return the most rows that a whole team's observations need, with the paper's sight or any of the given ones."""
    teams = (rules.n_predators, rules.n_prey), (rules.n_prey, rules.n_predators)
    return max(n_own * sight.n_seen(n_own, others) for sight in (PLAIN_SIGHT, *sights) for n_own, others in teams)


def make_seen(rules: Rules, *sights: AnySight) -> np.ndarray:
    """Allocate scratch memory for the observations of a whole team, float32 ``(rows, LANES)``."""
    return lane_zeros(np.float32, seen_rows(rules, *sights))


def make_world(rules: Rules) -> World:
    """Allocate a single world, in which :func:`measure` computes the fitness."""
    n_agents = rules.n_predators + rules.n_prey
    return World(np.zeros(n_agents, np.int32), np.zeros(n_agents, np.int32), np.zeros(rules.n_prey, np.int32))


@rule
def begin(block: Block, lane: int, start: Array, seed: int) -> None:
    """Start an episode in one world from cells, int32 ``(n_agents, 2)``; random choices follow from ``seed``."""
    for agent in range(start.shape[0]):
        block.world.x[agent, lane] = start[agent, 0]
        block.world.y[agent, lane] = start[agent, 1]
        block.moved[agent, lane] = IDLE
    for prey in range(len(block.world.alive)):
        block.world.alive[prey, lane] = 1
        block.survived[prey, lane] = 0
    block.clock[0, lane] = 0
    reset_memory(block, lane, seed)


@rule
def rows_of_memory(block: Block) -> int:
    """Return the number of memory rows of each agent."""
    return len(block.memory) // len(block.world.x)


@rule
def reset_memory(block: Block, lane: int, seed: int) -> None:
    """Reset the players' memory in one world to its state at the start of an episode."""
    n_predators, n_memory = len(block.world.x) - len(block.world.alive), rows_of_memory(block)
    for agent in range(len(block.world.x)):
        prey = agent >= n_predators
        number = agent - n_predators * prey
        for row in range(n_memory):
            block.memory[agent * n_memory + row, lane] = first_memory(seed, prey, number, row)


@rule
def observe_team(block: Block, first: int, n_agents: int, rules: Rules, sight: AnySight, seen: FloatRows) -> None:
    """Write the observations of a team, whose rows begin at ``first``, to ``seen``, one after the other."""
    row = 0
    for agent in range(n_agents):
        row = observe(sight, block.world, block.moved, first + agent, rules, seen, row)


@rule
def choose_actions(block: Block, first: int, n_agents: int, player: Player, rules: Rules, seen: FloatRows) -> None:
    """Let every agent of a team, whose rows begin at ``first``, observe and choose its action."""
    together = sees_team(player)  # such a player needs the observations of all agents before the first action
    sight, n_memory = sight_of(player), rows_of_memory(block)
    if together:
        observe_team(block, first, n_agents, rules, sight, seen)
    for agent in range(n_agents):
        if not together:
            observe(sight, block.world, block.moved, first + agent, rules, seen, 0)
        action = choose(player, agent, seen, block.memory, (first + agent) * n_memory)
        store(block.actions, first + agent, action)


@rule
def advance(block: Block, turn: int, rules: Rules) -> None:
    """Play the actions of the agents that move in a turn (see :mod:`predprey_env.rules.dynamics`).

    The prey's turn alone does not end a time step.
    """
    take_turn(block.world, block.actions, turn, rules)
    remember_moves(block.actions, turn, rules, block.moved)
    if turn != PREY:
        store(block.clock, 0, load(block.clock, 0) + 1)
        for prey in range(rules.n_prey):
            store(block.survived, prey, load(block.survived, prey) + load(block.world.alive, prey))


@rule
def play_step(block: Block, predators: Player, prey: Player, rules: Rules, seen: FloatRows) -> None:
    """Play one time step: all agents choose in the same state, or the prey move before the predators observe."""
    choose_actions(block, rules.n_predators, rules.n_prey, prey, rules, seen)
    if rules.prey_first:
        advance(block, PREY, rules)
    choose_actions(block, 0, rules.n_predators, predators, rules, seen)
    advance(block, PREDATORS if rules.prey_first else EVERYBODY, rules)


@rule
def measure(block: Block, lane: int, rules: Rules, one: World, out: Array) -> None:
    """Write every agent's fitness in one world, as if the episode ended now, to ``out``, float64 ``(n_agents,)``.

    ``one`` is scratch memory, a single world to which the lane is copied.
    """
    for agent in range(len(one.x)):
        one.x[agent] = block.world.x[agent, lane]
        one.y[agent] = block.world.y[agent, lane]
    for prey in range(len(one.alive)):
        one.alive[prey] = block.world.alive[prey, lane]
    fitness(one, block.clock[0, lane], rules, out)


@rule
def caught_at(block: Block, lane: int, prey: int) -> int:
    """Return the step in which a prey was caught in one world, counted from 1, or 0 if it is free."""
    return 0 if block.world.alive[prey, lane] != 0 else block.survived[prey, lane] + 1


@rule
def cells(block: Block, lane: int, out: Array) -> None:
    """Write every agent's cell in one world to ``out``, int32 ``(n_agents, 2)``."""
    for agent in range(len(block.world.x)):
        out[agent, 0] = block.world.x[agent, lane]
        out[agent, 1] = block.world.y[agent, lane]
