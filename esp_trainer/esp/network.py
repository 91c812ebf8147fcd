"""The forward pass: the one definition of what a network computes. Policy objects and the fused kernel both call it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from esp_trainer.networks.activations import exponential, logistic
from esp_trainer.networks.controller import Controller
from esp_trainer.networks.protocol import respond
from predprey_env.jit.compilation import rule
from predprey_env.jit.lanes import load, store, where
from predprey_env.jit.values import FloatRows, IntegerRows, Value
from predprey_env.policies.chance import next_state, unit_float
from predprey_env.policies.protocol import choose, memory_rows, sees_team, sight_of
from predprey_env.sight import AnySight

ONE, ZERO = np.float32(1.0), np.float32(0.0)


@rule
def add_votes(
    controller: Controller,
    weights: FloatRows,
    at: int,
    inputs: FloatRows,
    n_inputs: int,
    member: int,
    votes: FloatRows,
    row: int,
    memory: IntegerRows,
    context: int,
) -> None:
    """Add one network's outputs to the votes for each action, which begin at row ``row``.

    ``weights`` holds the gene strings of the network's hidden neurons, one after the other, from row ``at`` on. Of
    their output weights, those for a ``member`` of the team are used. The network's memory begins at row ``context``.
    """
    network, fan_in = controller.network, n_inputs + (1 if controller.bias else 0)
    outputs = respond(network, weights, at, inputs, fan_in, member * len(network.blank), memory, context)
    speaks = load(inputs, 0) != ZERO
    if controller.skip_silent:
        for i in range(1, n_inputs):
            speaks = speaks | (load(inputs, i) != ZERO)
    for action in range(len(outputs)):
        output = outputs[action]
        if controller.logistic_output:
            output = logistic(output)
        if controller.skip_silent:
            output = where(speaks, output, ZERO)
        store(votes, row + action, load(votes, row + action) + output)


@rule
def vote(
    controller: Controller,
    weights: FloatRows,
    at: int,
    member: int,
    seen: FloatRows,
    inputs: FloatRows,
    votes: FloatRows,
    memory: IntegerRows,
    context: int,
) -> None:
    """Write the votes of all networks for each action to the first rows of ``votes``.

    The votes are the sums of the networks' outputs (section VI, figure 3), or the outputs of the combiner (section
    VIII). ``weights`` holds the networks, one after the other, from row ``at`` on. ``member`` is the index of the
    voting agent among those that the networks control together. ``inputs`` and ``votes`` are scratch of at least
    ``max(fan_in) + 1`` and ``n_votes`` rows. The networks' memory begins at row ``context`` of ``memory``.
    """
    n_actions = len(controller.network.blank)
    for network in range(controller.n_networks + (1 if controller.combines else 0)):
        combiner = network == controller.n_networks
        n_inputs = controller.n_networks * n_actions if combiner else controller.n_inputs
        for i in range(n_inputs):
            if combiner:
                store(inputs, i, load(votes, i))
            else:
                store(inputs, i, load(seen, controller.wiring[network, i]) * controller.input_scale)
        store(inputs, n_inputs, ONE)
        row = network * n_actions if controller.combines and not combiner else 0
        if network == 0 or controller.combines:
            for action in range(n_actions):
                store(votes, row + action, ZERO)
        add_votes(controller, weights, at, inputs, n_inputs, member, votes, row, memory, context)
        at += controller.network.n_hidden * controller.network.n_genes
        context += controller.network.n_memory


@rule
def most_votes(controller: Controller, votes: FloatRows) -> Value:
    """Return the action with the most votes; ties go to the lowest index."""
    more = load(votes, 1) > load(votes, 0)
    most, winner = where(more, load(votes, 1), load(votes, 0)), where(more, 1, 0)
    for action in range(2, len(controller.network.blank)):
        more = load(votes, action) > most
        most, winner = where(more, load(votes, action), most), where(more, action, winner)
    return winner


@rule
def accumulate(controller: Controller, votes: FloatRows) -> Value:
    """Replace the votes by the cumulative sums of ``exp(votes)``, up to a factor; return the total."""
    n_actions, most = len(controller.network.blank), load(votes, 0)  # subtracting the largest vote avoids an overflow
    for action in range(1, n_actions):
        most = where(load(votes, action) > most, load(votes, action), most)
    total = exponential(load(votes, 0) - most)
    store(votes, 0, total)
    for action in range(1, n_actions):
        total = total + exponential(load(votes, action) - most)
        store(votes, action, total)
    return total


@rule
def sample_action(controller: Controller, votes: FloatRows, memory: IntegerRows, at: int) -> Value:
    """Sample an action with probabilities in proportion to ``exp(votes)``.

    Row ``at`` of ``memory`` holds the random state. The votes are overwritten. Once in 33 million samples the random
    number rounds up to 1, and the action is the last one whatever its probability.
    """
    n_actions, total = len(controller.network.blank), accumulate(controller, votes)
    state = load(memory, at)
    store(memory, at, next_state(state))
    point = unit_float(state) * total
    winner = where(point >= load(votes, 0), 1, 0)
    for action in range(1, n_actions - 1):
        winner = winner + where(point >= load(votes, action), 1, 0)
    return winner


class Networks(NamedTuple):
    """The networks of a team as a player in compiled code; see :func:`predprey_env.policies.protocol.choose`."""

    controller: Controller
    weights: FloatRows
    """Gene strings of all agents, one after the other: float32 rows."""
    inputs: FloatRows
    votes: FloatRows


@rule
def agent_votes(networks: Networks, agent: int, seen: FloatRows, memory: IntegerRows, at: int) -> None:
    """Write the votes of one agent of an evolved team for each action to the first rows of ``networks.votes``.

    For a central controller, ``seen`` holds the observations of all agents, one after the other. The agent's memory
    begins at row ``at``: a random state, then what its networks remember.
    """
    controller = networks.controller
    genome, member = agent // controller.n_together, agent % controller.n_together
    n_networks = controller.n_networks + (1 if controller.combines else 0)
    first = genome * n_networks * controller.network.n_hidden * controller.network.n_genes
    vote(controller, networks.weights, first, member, seen, networks.inputs, networks.votes, memory, at + 1)


@rule
def play(networks: Networks, agent: int, seen: FloatRows, memory: IntegerRows, at: int) -> Value:
    """Return the action of one agent of an evolved team; see :func:`predprey_env.policies.protocol.choose`."""
    agent_votes(networks, agent, seen, memory, at)
    if networks.controller.draws:
        return sample_action(networks.controller, networks.votes, memory, at)
    return most_votes(networks.controller, networks.votes)


@rule
def reads_team(networks: Networks) -> bool:
    """Return whether the controller is central; see :func:`predprey_env.policies.protocol.sees_team`."""
    return networks.controller.n_together > 1


@rule
def networks_sight(networks: Networks) -> AnySight:
    """Return what the agents observe; see :func:`predprey_env.policies.protocol.sight_of`."""
    return networks.controller.sight


def n_memory(networks: Networks) -> int:
    """Return the rows of memory of each agent; see :data:`predprey_env.policies.protocol.memory_rows`."""
    return networks.controller.n_memory


choose.register(Networks, play)
sees_team.register(Networks, reads_team)
sight_of.register(Networks, networks_sight)
memory_rows.register(Networks, n_memory)
