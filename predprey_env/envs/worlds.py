"""Many worlds side by side for the vector environments: the caller plays one team, or both.

In names, the *team* is the one that the caller plays, or the first of two, and the *opponents* are the other one.

The worlds are laid out in blocks of ``LANES`` and moved by :mod:`predprey_env.engine`. A world that is over does not
start again until :func:`place` is called.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from predprey_env.config import IDLE, EnvConfig, Rules
from predprey_env.engine import (
    Block,
    TeamRows,
    advance,
    begin,
    choose_actions,
    make_block,
    make_seen,
    make_world,
    measure,
    reset_memory,
    rows_of_memory,
)
from predprey_env.jit.compilation import entry_point, rule
from predprey_env.jit.lanes import LANES, lane_zeros, load, store, where
from predprey_env.jit.values import Array, FloatRows, IntegerRows
from predprey_env.policies.protocol import MEMORY, Player
from predprey_env.rules.dynamics import EVERYBODY, PREDATORS, PREY, World, is_over
from predprey_env.rules.observation import observe
from predprey_env.sight import AnySight


class Worlds(NamedTuple):
    """State of all worlds."""

    blocks: Block
    """int32 ``(n_blocks, rows, LANES)``."""
    over: Array
    """1 where the episode is over, else 0: int32 ``(n_blocks, 1, LANES)``. Where it is over, opponents neither choose
    nor move."""
    member: Array
    """Index of the opponent that plays, in the pool of opponents: int32 ``(n_blocks, 1, LANES)``."""

    def arrays(self) -> list[np.ndarray]:
        """Return all arrays of the state."""
        world, *rows = self.blocks
        return [*world, *rows, self.over, self.member]


class Scratch(NamedTuple):
    """Scratch memory of the kernels."""

    seen: FloatRows
    """Observations of a team: float32 ``(rows, LANES)``."""
    memory: IntegerRows
    """Memory of the players: int32 ``(rows, LANES)``."""
    actions: IntegerRows
    """Actions of all agents: int32 ``(n_agents, LANES)``."""
    one: World
    """A single world, for computing the fitness."""


def make_worlds(config: EnvConfig, n_worlds: int) -> Worlds:
    """Return the state of ``n_worlds`` worlds; the unused lanes of the last block are computed but never read."""
    n_blocks = -(-n_worlds // LANES)
    over, member = (lane_zeros(np.int32, n_blocks, 1) for _ in range(2))
    return Worlds(make_block(config.rules, n_blocks), over, member)


def make_scratch(config: EnvConfig) -> Scratch:
    """Return scratch memory for the kernels."""
    memory, actions = (lane_zeros(np.int32, rows) for rows in (config.n_agents * MEMORY, config.n_agents))
    return Scratch(make_seen(config.rules, config.sight), memory, actions, make_world(config.rules))


def with_memory(worlds: Worlds, scratch: Scratch, n_memory: int) -> tuple[Worlds, Scratch]:
    """Return worlds in which each agent has at least ``n_memory`` rows of memory, and scratch memory to match.

    The agents' first rows keep their content.
    """
    old = worlds.blocks.memory
    n_agents = worlds.blocks.actions.shape[1]
    n_old = old.shape[1] // n_agents
    if n_memory <= n_old:
        return worlds, scratch
    memory, spare = (lane_zeros(np.int32, *blocks, n_agents * n_memory) for blocks in ((len(old),), ()))
    by_agent = (len(old), n_agents, -1, LANES)
    memory.reshape(by_agent)[:, :, :n_old] = old.reshape(by_agent)
    return worlds._replace(blocks=worlds.blocks._replace(memory=memory)), scratch._replace(memory=spare)


def with_views(scratch: Scratch, rules: Rules, sights: Iterable[AnySight]) -> Scratch:
    """Return scratch memory with room for the observations of a team with any of the given sights."""
    seen = make_seen(rules, *sights)
    return scratch._replace(seen=seen) if len(seen) > len(scratch.seen) else scratch


# -- a block of worlds --------------------------------------------------------------------------------------------


@rule
def block_at(worlds: Worlds, at: int) -> Block:
    """Return a block of worlds."""
    blocks = worlds.blocks
    world = World(blocks.world.x[at], blocks.world.y[at], blocks.world.alive[at])
    clock, survived = blocks.clock[at], blocks.survived[at]
    return Block(world, clock, survived, blocks.actions[at], blocks.moved[at], blocks.memory[at])


@rule
def _play(worlds: Worlds, at: int, turn: int, rules: Rules) -> None:
    """Play a turn, and mark the worlds that are over."""
    block = block_at(worlds, at)
    advance(block, turn, rules)
    if turn != PREY:
        store(worlds.over[at], 0, where(is_over(block.world, load(block.clock, 0), rules), 1, 0))


@rule
def _turn_of(team: TeamRows) -> int:
    """Return the turn of a team, where teams move in turns."""
    return PREDATORS if team.first == 0 else PREY


@rule
def _choose(
    worlds: Worlds, at: int, opponents: TeamRows, player: Player, member: int, rules: Rules, scratch: Scratch
) -> None:
    """Let the opponents observe and choose in the lanes where this member of the pool plays and the episode goes on.

    In the other lanes they keep their memory and their actions.
    """
    block = block_at(worlds, at)
    plays = (load(worlds.over[at], 0) == 0) & (load(worlds.member[at], 0) == member)
    # A rule cannot skip single lanes: all lanes choose, then the others are restored.
    first, last, n_memory = opponents.first, opponents.first + opponents.n_agents, rows_of_memory(block)
    for row in range(first * n_memory, last * n_memory):
        store(scratch.memory, row, load(block.memory, row))
    for agent in range(first, last):
        store(scratch.actions, agent, load(block.actions, agent))
    choose_actions(block, first, opponents.n_agents, player, rules, scratch.seen)
    for row in range(first * n_memory, last * n_memory):
        store(block.memory, row, where(plays, load(block.memory, row), load(scratch.memory, row)))
    for agent in range(first, last):
        store(block.actions, agent, where(plays, load(block.actions, agent), load(scratch.actions, agent)))


@rule
def _stay(worlds: Worlds, at: int, team: TeamRows) -> None:
    """Let a team idle where the episode is over."""
    actions, over = worlds.blocks.actions[at], load(worlds.over[at], 0) != 0
    for agent in range(team.first, team.first + team.n_agents):
        store(actions, agent, where(over, IDLE, load(actions, agent)))


@rule
def _write(worlds: Worlds, at: int, team: TeamRows, actions: Array) -> None:
    """Write a team's actions, int32 ``(n_worlds, n_agents)``, to a block."""
    for lane in range(min(LANES, len(actions) - at * LANES)):
        for agent in range(team.n_agents):
            worlds.blocks.actions[at, team.first + agent, lane] = actions[at * LANES + lane, agent]


# -- what Python calls --------------------------------------------------------------------------------------------


@entry_point
def place(worlds: Worlds, which: Array, starts: Array, seeds: Array) -> None:
    """Start an episode in the worlds ``which``, int64 ``(n,)``, from cells int32 ``(n, n_agents, 2)``.

    The random choices of the opponents follow from ``seeds``, int64 ``(n,)``.
    """
    for i in range(len(which)):
        at, lane = which[i] // LANES, which[i] % LANES
        begin(block_at(worlds, at), lane, starts[i], seeds[i])
        worlds.over[at, 0, lane] = 0


@entry_point
def forget(worlds: Worlds, seeds: Array) -> None:
    """Reset the opponents' memory in all worlds to its state at the start of an episode, from ``seeds``, int64
    ``(n_worlds,)``.
    """
    for world in range(len(seeds)):
        reset_memory(block_at(worlds, world // LANES), world % LANES, seeds[world])


@entry_point
def move_team(worlds: Worlds, team: TeamRows, rules: Rules, actions: Array) -> None:
    """Write the team's actions, int32 ``(n_worlds, n_agents)``, and play them if teams move in turns."""
    for at in range(len(worlds.over)):
        _write(worlds, at, team, actions)
        if rules.prey_first:
            _play(worlds, at, _turn_of(team), rules)


@rule
def _move(worlds: Worlds, at: int, opponents: TeamRows, rules: Rules, scratch: Scratch) -> None:
    """Play the opponents' actions: together with the team's, or in a turn of their own.

    Where the episode is over, they idle, but their last moves in the state remain those of the episode.
    """
    first, last = opponents.first, opponents.first + opponents.n_agents
    moved, over = worlds.blocks.moved[at], load(worlds.over[at], 0) != 0
    for agent in range(first, last):
        store(scratch.actions, agent, load(moved, agent))
    _stay(worlds, at, opponents)
    _play(worlds, at, _turn_of(opponents) if rules.prey_first else EVERYBODY, rules)
    for agent in range(first, last):
        store(moved, agent, where(over, load(scratch.actions, agent), load(moved, agent)))


@entry_point
def move_opponents(worlds: Worlds, opponents: TeamRows, player: Player, rules: Rules, scratch: Scratch) -> None:
    """Let compiled opponents choose, and play their actions; for a pool of one."""
    for at in range(len(worlds.over)):
        _choose(worlds, at, opponents, player, 0, rules, scratch)
        _move(worlds, at, opponents, rules, scratch)


@entry_point
def let_member_choose(
    worlds: Worlds, opponents: TeamRows, player: Player, member: int, rules: Rules, scratch: Scratch
) -> None:
    """Let a compiled member of the pool choose in the worlds where it plays."""
    for at in range(len(worlds.over)):
        _choose(worlds, at, opponents, player, member, rules, scratch)


@entry_point
def write_actions(worlds: Worlds, opponents: TeamRows, which: Array, actions: Array) -> None:
    """Write the opponents' actions, int32 ``(n_worlds, n_agents)``, in the worlds that ``which`` marks.

    ``which`` is bool ``(n_worlds,)``.
    """
    for world in range(len(which)):
        if which[world]:
            for agent in range(opponents.n_agents):
                row = opponents.first + agent
                worlds.blocks.actions[world // LANES, row, world % LANES] = actions[world, agent]


@entry_point
def move_chosen(worlds: Worlds, opponents: TeamRows, rules: Rules, scratch: Scratch) -> None:
    """Play the actions that all members of the pool have chosen."""
    for at in range(len(worlds.over)):
        _move(worlds, at, opponents, rules, scratch)


@entry_point
def move_given(worlds: Worlds, opponents: TeamRows, rules: Rules, scratch: Scratch, actions: Array) -> None:
    """Play the opponents' actions that the caller gives, int32 ``(n_worlds, n_agents)``."""
    for at in range(len(worlds.over)):
        _write(worlds, at, opponents, actions)
        _move(worlds, at, opponents, rules, scratch)


@entry_point
def look(worlds: Worlds, team: TeamRows, rules: Rules, sight: AnySight, scratch: Scratch, views: Array) -> None:
    """Write the observations of every agent of a team to ``views``, float32 ``(n_worlds, n_agents, n_seen)``."""
    for at in range(len(worlds.over)):
        block = block_at(worlds, at)
        for agent in range(team.n_agents):
            n_seen = observe(sight, block.world, block.moved, team.first + agent, rules, scratch.seen, 0)
            for lane in range(min(LANES, len(views) - at * LANES)):
                for i in range(n_seen):
                    views[at * LANES + lane, agent, i] = scratch.seen[i, lane]


@entry_point
def score(worlds: Worlds, rules: Rules, scratch: Scratch, which: Array, scores: Array) -> None:
    """Write every agent's fitness in the worlds ``which``, as if the episode ended now, to ``scores``.

    ``scores`` is float64 ``(n_worlds, n_agents)``.
    """
    for world in which:
        measure(block_at(worlds, world // LANES), world % LANES, rules, scratch.one, scores[world])
