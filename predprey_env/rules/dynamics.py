"""One step of the world: how agents move, and which prey are caught (sections III and V).

Agents are rows, predators first. All functions change a :class:`World` in place and allocate nothing.
"""

from __future__ import annotations

from typing import NamedTuple

from predprey_env.config import Rules
from predprey_env.jit.compilation import rule
from predprey_env.jit.lanes import load, store, where
from predprey_env.jit.values import IntegerRows, Mask, Value
from predprey_env.rules.torus import wrap


class World(NamedTuple):
    """Positions and survivors of one world, or of a block of worlds with a last axis of ``LANES``."""

    x: IntegerRows
    """Columns, in cells, in [0, size): int32 ``(n_agents,)``. East is +1."""

    y: IntegerRows
    """Rows, in cells, in [0, size): int32 ``(n_agents,)``. North is +1."""

    alive: IntegerRows
    """1 for a free prey, 0 for a caught one: int32 ``(n_prey,)``."""


@rule
def step_of(action: Value) -> tuple[Value, Value]:
    """Return an action's move along x and along y: 0 east, 1 west, 2 north, 3 south, 4 idle."""
    return where(action == 0, 1, where(action == 1, -1, 0)), where(action == 2, 1, where(action == 3, -1, 0))


@rule
def target(world: World, agent: int, action: Value, size: int) -> tuple[Value, Value]:
    """Return the cell ``(x, y)`` that an action leads to."""
    east_west, north_south = step_of(action)
    return wrap(load(world.x, agent) + east_west, size), wrap(load(world.y, agent) + north_south, size)


@rule
def move_predators(world: World, actions: IntegerRows, rules: Rules) -> None:
    """Move every predator by its action."""
    for predator in range(rules.n_predators):
        x, y = target(world, predator, load(actions, predator), rules.size)
        store(world.x, predator, x)
        store(world.y, predator, y)


@rule
def move_prey(world: World, actions: IntegerRows, rules: Rules) -> None:
    """Move every free prey by its action; a caught prey stays where it is."""
    for prey in range(rules.n_prey):
        agent = rules.n_predators + prey
        free = load(world.alive, prey) != 0
        x, y = target(world, agent, load(actions, agent), rules.size)
        store(world.x, agent, where(free, x, load(world.x, agent)))
        store(world.y, agent, where(free, y, load(world.y, agent)))


@rule
def capture(world: World, rules: Rules) -> None:
    """Mark as caught every prey with a predator in its cell."""
    for prey in range(rules.n_prey):
        agent = rules.n_predators + prey
        alive = load(world.alive, prey)
        for predator in range(rules.n_predators):
            met = (load(world.x, predator) == load(world.x, agent)) & (load(world.y, predator) == load(world.y, agent))
            alive = where(met, 0, alive)
        store(world.alive, prey, alive)


@rule
def capture_swaps(world: World, actions: IntegerRows, rules: Rules) -> None:
    """Mark as caught every prey that is about to trade cells with a predator; call it before the moves."""
    for prey in range(rules.n_prey):
        agent = rules.n_predators + prey
        alive = load(world.alive, prey)
        prey_x, prey_y = target(world, agent, load(actions, agent), rules.size)
        for predator in range(rules.n_predators):
            x, y = target(world, predator, load(actions, predator), rules.size)
            prey_arrives = (prey_x == load(world.x, predator)) & (prey_y == load(world.y, predator))
            predator_arrives = (x == load(world.x, agent)) & (y == load(world.y, agent))
            alive = where(prey_arrives & predator_arrives, 0, alive)
        store(world.alive, prey, alive)


@rule
def step(world: World, actions: IntegerRows, rules: Rules) -> None:
    """Play one time step in which all agents move at once.

    ``actions`` is int32 ``(n_agents,)``; the actions of caught prey are ignored.
    """
    if rules.swap_captures:
        capture_swaps(world, actions, rules)
    move_prey(world, actions, rules)
    move_predators(world, actions, rules)
    capture(world, rules)


@rule
def prey_turn(world: World, actions: IntegerRows, rules: Rules) -> None:
    """Play the first half of a time step in turns: the prey move, and the predators see it before they choose."""
    move_prey(world, actions, rules)
    capture(world, rules)


@rule
def predators_turn(world: World, actions: IntegerRows, rules: Rules) -> None:
    """Play the second half of a time step in turns: the predators move."""
    move_predators(world, actions, rules)
    capture(world, rules)


# Values of ``turn``: the agents that move in it.
NOBODY, EVERYBODY, PREY, PREDATORS = range(4)


@rule
def take_turn(world: World, actions: IntegerRows, turn: int, rules: Rules) -> None:
    """Play a whole time step, or the half of it in which one team moves."""
    if turn == EVERYBODY:
        step(world, actions, rules)
    elif turn == PREY:
        prey_turn(world, actions, rules)
    elif turn == PREDATORS:
        predators_turn(world, actions, rules)


@rule
def remember_moves(actions: IntegerRows, turn: int, rules: Rules, moved: IntegerRows) -> None:
    """Write the actions of the agents that move in a turn to ``moved``, which holds the last action of every agent.

    The entry of a caught prey is meaningless. Before the first move all entries are :data:`~predprey_env.config.IDLE`.
    """
    first = rules.n_predators if turn == PREY else 0
    last = rules.n_predators if turn == PREDATORS else rules.n_predators + rules.n_prey
    if turn != NOBODY:
        for agent in range(first, last):
            store(moved, agent, load(actions, agent))


@rule
def count_alive(world: World, rules: Rules) -> Value:
    """Return the number of prey that are not caught."""
    alive = load(world.alive, 0)
    for prey in range(1, rules.n_prey):
        alive = alive + load(world.alive, prey)
    return alive


@rule
def is_over(world: World, steps: Value, rules: Rules) -> Mask:
    """Return whether an episode ends after ``steps`` steps: all prey are caught, or the time is up."""
    return (count_alive(world, rules) == 0) | (steps >= rules.max_cycles)
