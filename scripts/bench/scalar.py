"""The alternative in Numba: plain loops, one episode after the other, as one writes them without SIMD lanes.

Everything that makes such loops fast is here: one compiled function, float32, memory allocated once, the weights of a
trial copied together, episodes that end when all prey are caught, inert prey that need not choose, ``fastmath``. The
rules are the project's own, compiled for one world. Split networks without bias, unscaled, with logistic outputs.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from esp_trainer.types import EvolvedTeams, TeamBatch, TrialBatch, TrialResult
from predprey_env.config import EnvConfig, Rules
from predprey_env.rules.dynamics import World, count_alive, step
from predprey_env.rules.fitness import fitness
from predprey_env.rules.observation import observe

PREDATOR_ACTIONS, PREY_ACTIONS = 5, 4
"""Known while compiling, so that the loops over actions are unrolled: a third of the whole."""

ZERO, ONE, LIMIT = np.float32(0.0), np.float32(1.0), np.float32(60.0)
_compiled = njit(nogil=True, fastmath=True, error_model="numpy")


@_compiled
def _logistic(z: Any) -> Any:
    # Within the limit ``expf`` never takes its slow way out for results that overflow: 6 % of the whole.
    return ONE / (ONE + math.exp(min(max(-z, -LIMIT), LIMIT)))


@_compiled
def _gather(genomes: Any, indices: Any, weights: Any) -> None:
    """Copy one team's gene strings together."""
    at = 0
    for agent in range(indices.shape[0]):
        for network in range(indices.shape[1]):
            for neuron in range(indices.shape[2]):
                candidate = indices[agent, network, neuron]
                for gene in range(genomes.shape[4]):
                    weights[at] = genomes[agent, network, neuron, candidate, gene]
                    at += 1


@_compiled
def _choose(
    weights: Any, at: int, n_networks: int, n_hidden: int, n_actions: int, seen: Any, outputs: Any, votes: Any
) -> int:
    """The action of the agent whose networks begin at a place."""
    for action in range(n_actions):
        votes[action] = ZERO
    for network in range(n_networks):
        dx, dy = seen[2 * network], seen[2 * network + 1]
        for action in range(n_actions):
            outputs[action] = ZERO
        for _ in range(n_hidden):
            activation = _logistic(weights[at] * dx + weights[at + 1] * dy)
            for action in range(n_actions):
                outputs[action] += activation * weights[at + 2 + action]
            at += 2 + n_actions
        for action in range(n_actions):
            votes[action] += _logistic(outputs[action])
    winner = 0
    for action in range(1, n_actions):
        if votes[action] > votes[winner]:
            winner = action
    return winner


@_compiled
def _play(
    rules: Rules,
    predators: tuple[Any, Any],
    prey: tuple[Any, Any],
    starts: Any,
    scores: Any,
    captured: Any,
    lengths: Any,
) -> None:
    """All episodes of all trials; a side is its genomes and its teams' indices."""
    n_predators, n_prey, n_hidden = rules.n_predators, rules.n_prey, prey[1].shape[3]
    n_agents = n_predators + n_prey
    hunters = np.empty(predators[1][0].size * predators[0].shape[4], np.float32)
    hunted = np.empty(prey[1][0].size * prey[0].shape[4], np.float32)
    per_hunter, per_hunted = len(hunters) // n_predators, len(hunted) // n_prey
    world = World(np.zeros(n_agents, np.int32), np.zeros(n_agents, np.int32), np.zeros(n_prey, np.int32))
    actions, seen = np.zeros(n_agents, np.int32), np.zeros(2 * n_agents, np.float32)
    outputs, votes = np.zeros(PREDATOR_ACTIONS, np.float32), np.zeros(PREDATOR_ACTIONS, np.float32)
    for trial in range(starts.shape[0]):
        _gather(predators[0], predators[1][trial], hunters)
        _gather(prey[0], prey[1][trial], hunted)
        for episode in range(starts.shape[1]):
            for agent in range(n_agents):
                world.x[agent] = starts[trial, episode, agent, 0]
                world.y[agent] = starts[trial, episode, agent, 1]
            world.alive[:] = 1
            steps = 0
            while steps < rules.max_cycles and count_alive(world, rules) > 0:
                for agent in range(n_predators):
                    observe(world, agent, rules, seen, 0)
                    at = agent * per_hunter
                    actions[agent] = _choose(hunters, at, n_prey, n_hidden, PREDATOR_ACTIONS, seen, outputs, votes)
                for agent in range(n_prey):
                    if world.alive[agent] != 0:
                        observe(world, n_predators + agent, rules, seen, 0)
                        at = agent * per_hunted
                        action = _choose(hunted, at, n_predators, n_hidden, PREY_ACTIONS, seen, outputs, votes)
                        actions[n_predators + agent] = action
                step(world, actions, rules)
                steps += 1
            fitness(world, steps, rules, scores[trial, episode])
            for agent in range(n_prey):
                captured[trial, episode, agent] = world.alive[agent] == 0
            lengths[trial, episode] = steps


def play(env: EnvConfig, batch: TrialBatch) -> TrialResult:
    """Play every episode of every trial."""
    shape = batch.starts.shape[:2]
    result = TrialResult(
        np.zeros((*shape, env.n_agents)), np.zeros((*shape, env.n_prey), np.bool_), np.zeros(shape, np.int64)
    )
    _play(
        env.rules,
        _side(batch.predators),
        _side(batch.prey),
        batch.starts,
        result.fitness,
        result.captured,
        result.steps,
    )
    return result


def _side(teams: TeamBatch) -> tuple[np.ndarray, np.ndarray]:
    if not isinstance(teams, EvolvedTeams):
        raise ValueError(f"both sides must evolve, got {teams!r}")
    return teams.genomes, teams.indices
