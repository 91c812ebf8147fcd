"""The fused kernel: plays trials on the block engine, from the genes of both teams to the results of all episodes.

Each lane plays its own trial, one episode after the other: when an episode ends, the lane starts its next. A block is
done when its slowest lane is.
"""

from __future__ import annotations

from math import prod
from typing import NamedTuple

import numpy as np

from esp_trainer.esp.network import Networks, play, reads_team
from esp_trainer.networks.controller import Controller
from predprey_env.config import Rules
from predprey_env.engine import Block, begin, caught_at, cells, make_block, make_seen, make_world, measure, play_step
from predprey_env.jit.compilation import entry_point, rule
from predprey_env.jit.lanes import LANES, any_of, lane_zeros, load, store, where
from predprey_env.jit.values import Array, FloatRows, IntegerRows, Value
from predprey_env.policies.chance import scramble
from predprey_env.policies.protocol import choose, memory_rows, sees_team, sight_of
from predprey_env.policies.scripted import Script, follow
from predprey_env.rules.dynamics import World, is_over
from predprey_env.sight import AnySight

PARKED = -(1 << 30)
"""Clock of a lane that has no more episodes to play: it never reaches the time limit."""


class BatchSide(NamedTuple):
    """One side of a batch as the kernel reads it: the candidates and the indices of its teams, or a script.

    Both have the same type, so that the kernel is compiled once for all pairings.
    """

    script: Script
    """Script that the side follows; its number is 0 if networks play."""
    controller: Controller
    genomes: Array
    indices: Array


class Entrants(NamedTuple):
    """The teams of one side in a block of trials, as a player: one in each lane, or a script in all of them."""

    script: Script
    networks: Networks


class Memory(NamedTuple):
    """Working memory of one block of trials."""

    block: Block
    one: World
    """A single world, in which the kernel scores a lane."""
    seen: FloatRows
    predators: Entrants
    prey: Entrants
    ended: IntegerRows
    """1 where a lane's episode has just ended: int32 ``(1, LANES)``."""
    episode: Array
    """Index of the episode that each lane plays: int64 ``(LANES,)``."""


class Recorded(NamedTuple):
    """Arrays that the kernel writes: those of :class:`esp_trainer.types.TrialResult`, and the
    :class:`esp_trainer.types.Trace` of the first ``len(cells)`` trials.
    """

    fitness: Array
    caught_at: Array
    steps: Array
    cells: Array
    actions: Array


def make_memory(rules: Rules, predators: BatchSide, prey: BatchSide) -> Memory:
    """Return working memory for a thread that plays blocks."""
    both = _entrants(predators), _entrants(prey)
    return Memory(
        block=make_block(rules, n_memory=max(memory_rows(each.networks) for each in both)),
        one=make_world(rules),
        seen=make_seen(rules, *(each.networks.controller.sight for each in both)),
        predators=both[0],
        prey=both[1],
        ended=lane_zeros(np.int32, 1),
        episode=np.zeros(LANES, np.int64),
    )


def _entrants(side: BatchSide) -> Entrants:
    controller, n_genes = side.controller, prod(side.indices.shape[1:]) * side.genomes.shape[-1]
    weights, inputs, votes = (
        lane_zeros(np.float32, rows) for rows in (n_genes, max(controller.fan_in) + 1, controller.n_votes)
    )
    return Entrants(side.script, Networks(controller, weights, inputs, votes))


@rule
def choose_entrant(entrants: Entrants, agent: int, seen: FloatRows, memory: IntegerRows, at: int) -> Value:
    """Return the action of one agent; see :func:`predprey_env.policies.protocol.choose`."""
    if entrants.script.number != 0:
        return follow(entrants.script, agent, seen, memory, at)
    return play(entrants.networks, agent, seen, memory, at)


@rule
def entrants_read_team(entrants: Entrants) -> bool:
    """Return whether central controllers play; see :func:`predprey_env.policies.protocol.sees_team`."""
    return reads_team(entrants.networks)


@rule
def entrants_sight(entrants: Entrants) -> AnySight:
    """Return the sight of the networks. A script has unused networks with the sight that scripts have."""
    return entrants.networks.controller.sight


choose.register(Entrants, choose_entrant)
sees_team.register(Entrants, entrants_read_team)
sight_of.register(Entrants, entrants_sight)


@rule
def _gather(side: BatchSide, first_trial: int, active: int, weights: FloatRows) -> None:
    """Copy the gene strings of a block's teams into lanes; lanes without a trial repeat the first."""
    n_agents, n_networks, n_hidden = side.indices.shape[1:]
    row = 0
    for agent in range(n_agents):
        for network in range(n_networks):
            for neuron in range(n_hidden):
                for lane in range(LANES):
                    trial = first_trial + (lane if lane < active else 0)
                    candidate = side.indices[trial, agent, network, neuron]
                    for gene in range(side.genomes.shape[4]):
                        weights[row + gene, lane] = side.genomes[agent, network, neuron, candidate, gene]
                row += side.genomes.shape[4]


@rule
def seed_of(start: Array) -> int:
    """Return the seed with which both teams are reset in an episode.

    The seed depends on ``start``, int32 ``(n_agents, 2)``, alone, so that an episode does not depend on the other
    episodes of its batch.
    """
    seed = 0
    for agent in range(start.shape[0]):
        for axis in range(2):
            seed = scramble(seed, start[agent, axis])
    return seed


@rule
def _begin(memory: Memory, lane: int, starts: Array, trial: int, outcome: Recorded) -> None:
    """Set a lane's world to the start of its episode."""
    start = starts[trial, memory.episode[lane]]
    begin(memory.block, lane, start, seed_of(start))
    _record(memory, lane, trial, outcome)


@rule
def _park(memory: Memory, lane: int) -> None:
    """Let a lane that has no more episodes run on without results."""
    memory.block.clock[0, lane] = PARKED


@rule
def _record(memory: Memory, lane: int, trial: int, outcome: Recorded) -> None:
    """Write a lane's cells, and the actions that led there, if its trial is traced."""
    if trial < len(outcome.cells):
        episode, clock = memory.episode[lane], memory.block.clock[0, lane]
        cells(memory.block, lane, outcome.cells[trial, episode, clock])
        if clock > 0:
            for agent in range(outcome.actions.shape[3]):
                outcome.actions[trial, episode, clock - 1, agent] = memory.block.actions[agent, lane]


@rule
def _score(memory: Memory, lane: int, trial: int, rules: Rules, outcome: Recorded) -> None:
    """Write the result of a lane's episode."""
    episode = memory.episode[lane]
    measure(memory.block, lane, rules, memory.one, outcome.fitness[trial, episode])
    for prey in range(rules.n_prey):
        outcome.caught_at[trial, episode, prey] = caught_at(memory.block, lane, prey)
    outcome.steps[trial, episode] = memory.block.clock[0, lane]


@rule
def _load_block(
    predators: BatchSide,
    prey: BatchSide,
    starts: Array,
    first_trial: int,
    active: int,
    outcome: Recorded,
    memory: Memory,
) -> None:
    """Copy the teams of a block's trials into lanes, and set every lane to its first start."""
    _gather(predators, first_trial, active, memory.predators.networks.weights)
    _gather(prey, first_trial, active, memory.prey.networks.weights)
    for lane in range(LANES):
        memory.episode[lane] = 0
        _begin(memory, lane, starts, first_trial + (lane if lane < active else 0), outcome)
        if lane >= active:
            _park(memory, lane)


@rule
def _end_episodes(memory: Memory, starts: Array, first_trial: int, active: int, rules: Rules, outcome: Recorded) -> int:
    """Score the lanes whose episode is over, and start their next. Return the number of lanes without a next one."""
    finished = 0
    for lane in range(active):
        if memory.ended[0, lane] != 0:
            _score(memory, lane, first_trial + lane, rules, outcome)
            memory.episode[lane] += 1
            if memory.episode[lane] < starts.shape[1]:
                _begin(memory, lane, starts, first_trial + lane, outcome)
            else:
                _park(memory, lane)
                finished += 1
    return finished


@entry_point
def play_blocks(
    rules: Rules, predators: BatchSide, prey: BatchSide, starts: Array, outcome: Recorded, memory: Memory
) -> None:
    """Play trials, in blocks of ``LANES``."""
    block = memory.block
    for first_trial in range(0, len(starts), LANES):
        active = min(LANES, len(starts) - first_trial)
        _load_block(predators, prey, starts, first_trial, active, outcome, memory)
        unfinished = active
        while unfinished > 0:
            play_step(block, memory.predators, memory.prey, rules, memory.seen)
            if len(outcome.cells) > 0:
                for lane in range(active):
                    if block.clock[0, lane] > 0:
                        _record(memory, lane, first_trial + lane, outcome)
            clock = load(block.clock, 0)
            ended = is_over(block.world, clock, rules) & (clock > 0)  # the clock of a parked lane is negative
            if any_of(ended):
                store(memory.ended, 0, where(ended, 1, 0))
                unfinished -= _end_episodes(memory, starts, first_trial, active, rules, outcome)
