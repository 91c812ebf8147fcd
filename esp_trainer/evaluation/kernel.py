"""The fused kernel: plays sixteen trials side by side, from observation to fitness, in compiled code.

Each lane plays its own trial, one episode after the other: when an episode ends, the lane starts its next. A block is
done when its slowest lane is. The rules, the observation and the forward pass are the functions that the PettingZoo
environment and the policy objects call.
"""

from __future__ import annotations

from math import prod
from typing import Any, NamedTuple

import numpy as np

from esp_trainer.esp.network import Networks, play
from esp_trainer.types import Controller
from predprey_env.compilation import entry_point, rule
from predprey_env.config import Rules
from predprey_env.dynamics import World, is_over, predators_turn, prey_turn, step
from predprey_env.fitness import fitness
from predprey_env.lanes import LANES, any_of, lane_zeros, load, store, where
from predprey_env.observation import observe
from predprey_env.policies.chance import scramble
from predprey_env.policies.protocol import MEMORY, first_memory
from predprey_env.policies.scripted import Script, follow

PARKED = -(1 << 30)
"""Clock of a lane that has no more episodes to play: it never reaches the time limit."""


class Side(NamedTuple):
    """One side of a batch as the kernel reads it: networks or a script.

    Both have the same type, so that the kernel is compiled once for all pairings.
    """

    script: Script
    """Script that the side follows; its number is 0 if networks play."""
    controller: Controller
    genomes: Any
    indices: Any


class Memory(NamedTuple):
    """Working memory of one block of trials. All arrays but ``one`` and ``episode`` have a last axis of ``LANES``."""

    world: World
    one: World
    """A single world, in which the kernel scores a lane."""
    clock: Any
    actions: Any
    kept: Any
    """Memory of the agents, for scripts and for sampled actions: ``MEMORY`` rows for each agent."""
    predator_weights: Any
    prey_weights: Any
    seen: Any
    inputs: Any
    votes: Any
    ended: Any
    """1 where a lane's episode has just ended."""
    episode: Any
    """Index of the episode that each lane plays."""


class Outcome(NamedTuple):
    """Arrays that the kernel writes: the fields of :class:`esp_trainer.types.TrialResult`, and the trace."""

    fitness: Any
    captured: Any
    steps: Any
    trace: Any
    """Cells of every agent at every step, for the first ``len(trace)`` trials."""


def make_memory(rules: Rules, predators: Side, prey: Side) -> Memory:
    """Return working memory for a thread that plays blocks."""
    n_agents = rules.n_predators + rules.n_prey
    genes = [prod(side.indices.shape[1:]) * side.genomes.shape[-1] for side in (predators, prey)]
    controllers = predators.controller, prey.controller

    return Memory(
        world=World(*(lane_zeros(np.int32, rows) for rows in (n_agents, n_agents, rules.n_prey))),
        one=World(np.zeros(n_agents, np.int32), np.zeros(n_agents, np.int32), np.zeros(rules.n_prey, np.int32)),
        clock=lane_zeros(np.int32, 1),
        actions=lane_zeros(np.int32, n_agents),
        kept=lane_zeros(np.int32, n_agents * MEMORY),
        predator_weights=lane_zeros(np.float32, genes[0]),
        prey_weights=lane_zeros(np.float32, genes[1]),
        seen=lane_zeros(np.float32, 2 * rules.n_predators * rules.n_prey),
        inputs=lane_zeros(np.float32, max(max(controller.fan_in) for controller in controllers) + 1),
        votes=lane_zeros(np.float32, max(controller.n_votes for controller in controllers)),
        ended=lane_zeros(np.int32, 1),
        episode=np.zeros(LANES, np.int64),
    )


@rule
def _gather(side: Side, first_trial: int, active: int, weights: Any) -> None:
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
def seed_of(start: Any) -> int:
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
def _begin(memory: Memory, lane: int, starts: Any, trial: int, outcome: Outcome) -> None:
    """Set a lane's world to the start of its episode."""
    episode = memory.episode[lane]
    n_predators = starts.shape[2] - len(memory.world.alive)
    seed = seed_of(starts[trial, episode])
    for agent in range(starts.shape[2]):
        memory.world.x[agent, lane] = starts[trial, episode, agent, 0]
        memory.world.y[agent, lane] = starts[trial, episode, agent, 1]
        prey = agent >= n_predators
        number = agent - n_predators * prey
        for row in range(MEMORY):
            memory.kept[agent * MEMORY + row, lane] = first_memory(seed, prey, number, row)
    for prey in range(len(memory.world.alive)):
        memory.world.alive[prey, lane] = 1
    memory.clock[0, lane] = 0
    _record(memory, lane, trial, outcome)


@rule
def _park(memory: Memory, lane: int) -> None:
    """Let a lane that has no more episodes run on without results."""
    memory.clock[0, lane] = PARKED


@rule
def _record(memory: Memory, lane: int, trial: int, outcome: Outcome) -> None:
    """Write a lane's positions to the trace, if its trial is traced."""
    if trial < len(outcome.trace):
        cells = outcome.trace[trial, memory.episode[lane], memory.clock[0, lane]]
        for agent in range(len(cells)):
            cells[agent, 0] = memory.world.x[agent, lane]
            cells[agent, 1] = memory.world.y[agent, lane]


@rule
def _choose(side: Side, weights: Any, agent: int, kept: int, memory: Memory) -> Any:
    """Return the action of one agent of a side from its observation. Its memory begins at row ``kept``."""
    if side.script.number != 0:
        return follow(side.script, agent, memory.seen, memory.kept, kept)
    networks = Networks(side.controller, weights, memory.inputs, memory.votes)
    return play(networks, agent, memory.seen, memory.kept, kept)


@rule
def _team_chooses(memory: Memory, side: Side, weights: Any, first: int, n_agents: int, rules: Rules) -> None:
    """Choose the action of every agent of a team from its observation."""
    # A central controller needs the observations of all agents before the first action.
    central = side.controller.n_together > 1
    if central:
        row = 0
        for agent in range(n_agents):
            row = observe(memory.world, first + agent, rules, memory.seen, row)
    for agent in range(n_agents):
        if not central:
            observe(memory.world, first + agent, rules, memory.seen, 0)
        kept = (first + agent) * MEMORY
        store(memory.actions, first + agent, _choose(side, weights, agent, kept, memory))


@rule
def move(memory: Memory, predators: Side, prey: Side, rules: Rules) -> None:
    """Play one time step: all choose in the same state, or the prey move before the predators observe."""
    _team_chooses(memory, prey, memory.prey_weights, rules.n_predators, rules.n_prey, rules)
    if rules.prey_first:
        prey_turn(memory.world, memory.actions, rules)
    _team_chooses(memory, predators, memory.predator_weights, 0, rules.n_predators, rules)
    if rules.prey_first:
        predators_turn(memory.world, memory.actions, rules)
    else:
        step(memory.world, memory.actions, rules)
    store(memory.clock, 0, load(memory.clock, 0) + 1)


@rule
def _score(memory: Memory, lane: int, trial: int, rules: Rules, outcome: Outcome) -> None:
    """Write the result of a lane's episode."""
    one, episode, steps = memory.one, memory.episode[lane], memory.clock[0, lane]
    for agent in range(len(one.x)):
        one.x[agent] = memory.world.x[agent, lane]
        one.y[agent] = memory.world.y[agent, lane]
    for prey in range(len(one.alive)):
        one.alive[prey] = memory.world.alive[prey, lane]
        outcome.captured[trial, episode, prey] = one.alive[prey] == 0
    fitness(one, steps, rules, outcome.fitness[trial, episode])
    outcome.steps[trial, episode] = steps


@rule
def _load_block(
    predators: Side, prey: Side, starts: Any, first_trial: int, active: int, outcome: Outcome, memory: Memory
) -> None:
    """Copy the teams of a block's trials into lanes, and set every lane to its first start."""
    _gather(predators, first_trial, active, memory.predator_weights)
    _gather(prey, first_trial, active, memory.prey_weights)
    for lane in range(LANES):
        memory.episode[lane] = 0
        _begin(memory, lane, starts, first_trial + (lane if lane < active else 0), outcome)
        if lane >= active:
            _park(memory, lane)


@rule
def _end_episodes(memory: Memory, starts: Any, first_trial: int, active: int, rules: Rules, outcome: Outcome) -> int:
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
def play_blocks(rules: Rules, predators: Side, prey: Side, starts: Any, outcome: Outcome, memory: Memory) -> None:
    """Play trials, in blocks of ``LANES``."""
    for first_trial in range(0, len(starts), LANES):
        active = min(LANES, len(starts) - first_trial)
        _load_block(predators, prey, starts, first_trial, active, outcome, memory)
        unfinished = active
        while unfinished > 0:
            move(memory, predators, prey, rules)
            if len(outcome.trace) > 0:
                for lane in range(active):
                    if memory.clock[0, lane] > 0:
                        _record(memory, lane, first_trial + lane, outcome)
            clock = load(memory.clock, 0)
            ended = is_over(memory.world, clock, rules) & (clock > 0)  # the clock of a parked lane is negative
            if any_of(ended):
                store(memory.ended, 0, where(ended, 1, 0))
                unfinished -= _end_episodes(memory, starts, first_trial, active, rules, outcome)
