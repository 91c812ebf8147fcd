"""The states of the game of predators and one prey on a small torus: where the predators are, seen from the prey.

A predator's *cell* is the number ``size * dx + dy`` of its offset from the prey. Which predator is where makes no
difference, and neither does turning or mirroring the torus about the prey: of all states that come to the same, one
stands for all.
"""

from __future__ import annotations

from itertools import permutations
from math import comb
from typing import Any, NamedTuple

import numpy as np

from predprey_env.compilation import entry_point, rule
from predprey_env.config import EnvConfig, Rules
from predprey_env.dynamics import World, predators_turn, prey_turn, step


class Moves(NamedTuple):
    """What becomes of a predator in a step, by its cell, its action and the prey's: ``(n_cells, n_actions, 4)``."""

    cell: Any
    """Its cell afterwards, int32."""
    caught: Any
    """Whether it has the prey, bool."""


class States(NamedTuple):
    """All states, numbered."""

    cells: Any
    """The predators' cells in the states that stand for others, ascending: int32 ``(n_states, n_predators)``."""
    number: Any
    """Which of them stands for each: int32 ``(n_cells ** n_predators,)``, by the predators' cells as digits."""


def moves_of(config: EnvConfig) -> Moves:
    """Worked out by the rules of the world themselves. Predators do not get in each other's way, so one is enough."""
    n_cells, rules = config.size**2, config.replace(n_predators=1, n_prey=1).rules
    moves = Moves(
        np.zeros((n_cells, config.n_predator_actions, config.n_prey_actions), np.int32),
        np.zeros((n_cells, config.n_predator_actions, config.n_prey_actions), np.bool_),
    )
    world = World(np.zeros(2, np.int32), np.zeros(2, np.int32), np.ones(1, np.int32))
    _fill_moves(moves, rules, world, np.zeros(2, np.int32))
    return moves


@entry_point
def _fill_moves(moves: Moves, rules: Rules, world: World, actions: Any) -> None:
    size = rules.size
    for cell in range(moves.cell.shape[0]):
        for action in range(moves.cell.shape[1]):
            for prey_action in range(moves.cell.shape[2]):
                world.x[0], world.y[0], world.x[1], world.y[1] = cell // size, cell % size, 0, 0
                world.alive[0] = 1
                actions[0], actions[1] = action, prey_action
                if rules.prey_first:
                    prey_turn(world, actions, rules)
                    predators_turn(world, actions, rules)
                else:
                    step(world, actions, rules)
                dx, dy = (world.x[0] - world.x[1]) % size, (world.y[0] - world.y[1]) % size
                moves.cell[cell, action, prey_action] = dx * size + dy
                moves.caught[cell, action, prey_action] = world.alive[0] == 0


def states_of(size: int, n_predators: int) -> States:
    """Every state in which the prey is free; those with a predator in its cell have the number -1."""
    n_cells = size * size
    number = np.full(n_cells**n_predators, -1, np.int32)
    orders = np.array(list(permutations(range(n_predators))), np.int32)
    cells = np.zeros((_count(n_cells, n_predators), n_predators), np.int32)
    place = np.ones(n_predators, np.int32)
    n_states = _number(States(cells, number), symmetries(size), orders, place, place.copy())
    return States(cells[:n_states].copy(), number)


def symmetries(size: int) -> np.ndarray:
    """Where turning and mirroring about the prey takes each cell, int32 ``(8, n_cells)``."""
    dx, dy = np.divmod(np.arange(size * size), size)
    images = [(a * dx, b * dy) for a in (1, -1) for b in (1, -1)]
    images += [(y, x) for x, y in images]
    return np.array([(x % size) * size + y % size for x, y in images], np.int32)


def _count(n_cells: int, n_predators: int) -> int:
    """Ways for predators that look alike to stand on cells other than the prey's: more than there are states."""
    return comb(n_cells - 2 + n_predators, n_predators)


@rule
def key_of(cells: Any, n_cells: int) -> int:
    """A state's place among all: its cells as digits."""
    key = 0
    for i in range(len(cells)):
        key = key * n_cells + cells[i]
    return key


@entry_point
def _number(states: States, symmetries: Any, orders: Any, place: Any, image: Any) -> int:
    """Number the states in the order in which the first of each kind is met; returns how many there are.

    ``place``, which comes with the first of all states, and ``image`` are int32 ``(n_predators,)`` to work in.
    """
    n_cells, n_predators = symmetries.shape[1], len(place)
    found = 0
    while True:
        if states.number[key_of(place, n_cells)] < 0:
            for symmetry in range(len(symmetries)):
                for order in range(len(orders)):
                    for i in range(n_predators):
                        image[i] = symmetries[symmetry, place[orders[order, i]]]
                    states.number[key_of(image, n_cells)] = found
            for i in range(n_predators):
                states.cells[found, i] = place[i]
            found += 1
        last = n_predators - 1
        while last >= 0 and place[last] == n_cells - 1:
            last -= 1
        if last < 0:
            return found
        following = place[last] + 1
        for i in range(last, n_predators):
            place[i] = following
