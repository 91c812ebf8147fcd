"""States of the game of predators and prey on a small torus: the agents' positions relative to the first free prey.

An agent's *cell* is the number ``size * dx + dy`` of its offset from that prey. Predators are interchangeable, and so
are prey, and turning or mirroring the torus changes nothing: one representative stands for all equivalent states.
Caught prey are removed, so a game of two prey continues as a game of one.
"""

from __future__ import annotations

from itertools import permutations, product
from math import comb, factorial
from typing import Any, NamedTuple

import numpy as np

from predprey_env.config import EnvConfig, Rules
from predprey_env.jit.compilation import entry_point, rule
from predprey_env.rules.dynamics import EVERYBODY, PREDATORS, PREY, World, take_turn
from predprey_env.rules.torus import wrap


class Moves(NamedTuple):
    """Changes of an agent's cell in a turn, by its own action and by the action of the prey from which it is seen.

    An agent that does not move in the turn has one action.
    """

    size: int
    """Side of the torus, in cells."""

    cell: Any
    """Cell of a predator after the turn: int32 ``(n_cells, n_predator_actions, n_prey_actions)``."""
    caught: Any
    """True if the predator catches the prey: bool ``(n_cells, n_predator_actions, n_prey_actions)``."""
    apart: Any
    """Cell of another prey after the turn: int32 ``(n_cells, n_prey_actions, n_prey_actions)``."""


class States(NamedTuple):
    """The states of the game, numbered: first those with one prey left, then those with two, and so on.

    A *key* is the index of a position among all positions with the same number of prey. Its digits are the cells of all
    agents except the first prey, the predators first.
    """

    cells: Any
    """Cells of all agents in the representative states: int32 ``(n_states, n_agents)``.

    The predators' cells ascend, the first prey's cell is 0, and the cell of a caught prey is -1."""
    number: Any
    """Representative state of each key, -1 if a predator is in a prey's cell: int32, first the keys with one prey, then
    those with two, and so on."""
    first_key: Any
    """Index in ``number`` of the first key with 1, 2, ... prey, and the length of ``number``: int64 ``(n_prey +
    1,)``."""
    first: Any
    """Index of the first state with 1, 2, ... prey, and the number of states: int64 ``(n_prey + 1,)``."""


def turns_of(config: EnvConfig) -> tuple[Moves, ...]:
    """Return the turns of a time step, in order."""
    turns = (PREY, PREDATORS) if config.move_order == "prey_first" else (EVERYBODY,)
    return tuple(_moves_of(config, turn) for turn in turns)


def _moves_of(config: EnvConfig, turn: int) -> Moves:
    """Compute the moves of a turn by applying the rules of the world to two agents at a time."""
    n_cells, rules = config.size**2, config.rules
    n_actions = 1 if turn == PREY else config.n_predator_actions
    n_prey_actions = 1 if turn == PREDATORS else config.n_prey_actions
    hunt, flight = (n_cells, n_actions, n_prey_actions), (n_cells, n_prey_actions, n_prey_actions)
    moves = Moves(config.size, np.zeros(hunt, np.int32), np.zeros(hunt, np.bool_), np.zeros(flight, np.int32))
    world = World(np.zeros(2, np.int32), np.zeros(2, np.int32), np.ones(2, np.int32))
    actions, nobody = np.zeros(2, np.int32), np.zeros(flight, np.bool_)
    # Agents do not block each other, so the moves of two at a time give those of all.
    _fill_moves(moves.cell, moves.caught, turn, rules._replace(n_predators=1, n_prey=1), world, actions)
    _fill_moves(moves.apart, nobody, turn, rules._replace(n_predators=0, n_prey=2), world, actions)
    return moves


@entry_point
def _fill_moves(after: Any, caught: Any, turn: int, rules: Rules, world: World, actions: Any) -> None:
    """Write the moves of an agent in each cell, seen from a prey, to ``after`` and ``caught``."""
    size = rules.size
    for cell in range(after.shape[0]):
        for action in range(after.shape[1]):
            for prey_action in range(after.shape[2]):
                world.x[0], world.y[0], world.x[1], world.y[1] = cell // size, cell % size, 0, 0
                world.alive[:] = 1
                actions[0], actions[1] = action, prey_action
                take_turn(world, actions, turn, rules)
                dx, dy = wrap(world.x[0] - world.x[1], size), wrap(world.y[0] - world.y[1], size)
                after[cell, action, prey_action] = dx * size + dy
                caught[cell, action, prey_action] = world.alive[rules.n_prey - 1] == 0


def n_keys(size: int, n_predators: int, n_prey: int) -> int:
    """Return the number of keys with ``n_prey`` prey left."""
    return int((size * size) ** (n_predators + n_prey - 1))


def about_n_states(size: int, n_predators: int, n_prey: int) -> int:
    """Return an estimate, somewhat too high, of the number of states with ``n_prey`` prey left.

    Most states have ``images`` equivalent keys. The second term allows for symmetric states, which have fewer.
    """
    images = 8 * factorial(n_predators) * factorial(n_prey)  # eight symmetries of the torus, and all orders of agents
    return int(n_keys(size, n_predators, n_prey) // images + size ** (n_predators + n_prey - 1))


def states_of(size: int, n_predators: int, n_prey: int = 1) -> States:
    """Return all states in which no predator is in a prey's cell."""
    keys = np.cumsum([0, *(n_keys(size, n_predators, left) for left in range(1, n_prey + 1))])
    number = np.full(keys[-1], -1, np.int32)
    first, cells = [0], []
    for left in range(1, n_prey + 1):
        n_agents, of_game = n_predators + left, number[keys[left - 1] : keys[left]]
        room = np.zeros((_count(size * size, n_predators, left), n_agents), np.int32)
        scratch = np.zeros((2, n_agents), np.int32)
        orders = _orders(n_predators, left)
        found = _number(of_game, room, first[-1], size, symmetries(size), orders, n_predators, scratch)
        cells.append(np.pad(room[:found], ((0, 0), (0, n_prey - left)), constant_values=-1))
        first.append(first[-1] + found)
    return States(np.concatenate(cells), number, keys.astype(np.int64), np.array(first, np.int64))


def _orders(n_predators: int, n_prey: int) -> np.ndarray:
    """Return all orders of the predators and of the prey, int32 ``(n_orders, n_agents)``."""
    predators, prey = range(n_predators), range(n_predators, n_predators + n_prey)
    return np.array([a + b for a, b in product(permutations(predators), permutations(prey))], np.int32)


def symmetries(size: int) -> np.ndarray:
    """Return the cell to which each of the eight symmetries about the first prey maps each cell, int32 ``(8,
    n_cells)``.
    """
    dx, dy = np.divmod(np.arange(size * size), size)
    images = [(a * dx, b * dy) for a in (1, -1) for b in (1, -1)]
    images += [(y, x) for x, y in images]
    return np.array([(x % size) * size + y % size for x, y in images], np.int32)


def _count(n_cells: int, n_predators: int, n_prey: int) -> int:
    """Return an upper bound on the number of states: the positions, counted without regard to the order of the
    predators.
    """
    return int(comb(n_cells + n_predators - 1, n_predators) * n_cells ** (n_prey - 1))


@rule
def seen_from(cell: int, origin: int, size: int) -> int:
    """Return a cell as seen from an agent in the cell ``origin`` instead of from the first prey."""
    dx = wrap(cell // size - origin // size, size)
    return dx * size + wrap(cell % size - origin % size, size)


@rule
def read_key(key: int, n_cells: int, n_predators: int, cells: Any) -> bool:
    """Write a key's digits to ``cells``, with the first prey's cell, 0, among them; return whether no predator is in a
    prey's cell.
    """
    for i in range(len(cells) - 1, -1, -1):
        cells[i] = 0
        if i != n_predators:
            cells[i] = key % n_cells
            key //= n_cells
    for i in range(n_predators):
        for prey in range(n_predators, len(cells)):
            if cells[i] == cells[prey]:
                return False
    return True


@entry_point
def _number(
    number: Any, cells: Any, first: int, size: int, symmetries: Any, orders: Any, n_predators: int, scratch: Any
) -> int:
    """Number the states with the same number of prey, from ``first`` on, and return how many there are.

    States are numbered in the order in which the first key of each is met. ``orders`` are orders of all agents;
    ``scratch`` is int32 ``(2, n_agents)``.
    """
    n_cells, n_agents, found = symmetries.shape[1], scratch.shape[1], 0
    place, image = scratch[0], scratch[1]
    for key in range(len(number)):
        if number[key] >= 0 or not read_key(key, n_cells, n_predators, place):
            continue
        # Give the new state's number to the keys of all equivalent positions: every order of agents, every symmetry.
        for order in range(len(orders)):
            origin = place[orders[order, n_predators]]
            for i in range(n_agents):
                image[i] = seen_from(place[orders[order, i]], origin, size)
            for symmetry in range(len(symmetries)):
                like = 0
                for i in range(n_agents):
                    if i != n_predators:
                        like = like * n_cells + symmetries[symmetry, image[i]]
                number[like] = first + found
        for i in range(n_agents):
            cells[found, i] = place[i]
        found += 1
    return found
