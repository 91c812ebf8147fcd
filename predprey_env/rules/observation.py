"""The paper's observation: the offsets to the opposing team (section V), and what the options of :class:`Sight` add."""

from __future__ import annotations

import numpy as np

from predprey_env.config import Rules
from predprey_env.jit.compilation import rule
from predprey_env.jit.floats import as_float
from predprey_env.jit.lanes import load, store, where
from predprey_env.jit.values import FloatRows, IntegerRows, Mask, Value, Values
from predprey_env.rules.dynamics import World, step_of
from predprey_env.rules.torus import displacement, manhattan
from predprey_env.sight import Sight, observe

__all__ = ["move_of", "observe", "offset_to"]

ONE, ZERO = np.float32(1), np.float32(0)


@rule
def offsets_seen(
    sight: Sight, world: World, moved: IntegerRows, agent: int, rules: Rules, out: FloatRows, row: int
) -> int:
    """Write an agent's observation to ``out``, float32, from ``row`` on, and return the row after it.

    The observation holds, one after the other:

    - for each opponent, and with ``sight.teammates`` then for each team-mate, its offset along x and along y: other
      minus self, the shortest way round the torus, in cells;
    - with ``sight.moves``, for the same agents, their last moves along x and along y: -1, 0 or 1; ``moved`` holds the
      last action of every agent;
    - with ``sight.identity``, for each agent of the own team, 1 if it is the agent itself, else 0.

    Offsets and moves are 0 where one of the two agents is a caught prey.
    """
    predator = agent < rules.n_predators
    first = 0 if predator else rules.n_predators
    n_own = rules.n_predators if predator else rules.n_prey
    others, n_opponents = rules.n_predators - first, rules.n_predators + rules.n_prey - n_own
    n_mates = n_own if sight.teammates else 0
    offsets = row
    row = _see_offsets(world, agent, others, n_opponents, rules, out, row)
    row = _see_offsets(world, agent, first, n_mates, rules, out, row)
    moves = row
    if sight.moves:
        row = _see_moves(world, moved, agent, others, n_opponents, rules, out, row)
        row = _see_moves(world, moved, agent, first, n_mates, rules, out, row)
    if sight.nearest_first:
        _sort(n_opponents, sight, out, offsets, moves)
    if sight.scaled:
        for i in range(offsets, moves):
            store(out, i, load(out, i) * (as_float(2) / as_float(rules.size)))
    if sight.identity:
        for mate in range(n_own):
            store(out, row, ONE if first + mate == agent else ZERO)
            row += 1
    return row


observe.register(Sight, offsets_seen)


@rule
def offset_to(world: World, agent: int, other: int, rules: Rules) -> Values:
    """Return the offset ``(dx, dy)`` from one agent to another, the shortest way round the torus, in cells.

    It is (0, 0) if one of the two is a caught prey.
    """
    free = _both_free(world, agent, other, rules)
    dx = displacement(load(world.x, agent), load(world.x, other), rules.size)
    dy = displacement(load(world.y, agent), load(world.y, other), rules.size)
    return where(free, dx, 0), where(free, dy, 0)


@rule
def move_of(world: World, moved: IntegerRows, agent: int, other: int, rules: Rules) -> Values:
    """Return the last move ``(dx, dy)`` of an agent as another one sees it, in cells.

    It is (0, 0) before the first move, and if one of the two is a caught prey.
    """
    free = _both_free(world, agent, other, rules)
    dx, dy = step_of(load(moved, other))
    return where(free, dx, 0), where(free, dy, 0)


@rule
def _both_free(world: World, one: int, other: int, rules: Rules) -> Mask:
    """Return whether neither of two agents is a caught prey."""
    return _is_free(world, one, rules) & _is_free(world, other, rules)


@rule
def _is_free(world: World, agent: int, rules: Rules) -> Mask:
    if agent < rules.n_predators:
        return load(world.x, agent) >= 0  # true in every lane
    return load(world.alive, agent - rules.n_predators) != 0


@rule
def _see_offsets(world: World, agent: int, first: int, n: int, rules: Rules, out: FloatRows, row: int) -> int:
    """Write the offsets to ``n`` agents, from the agent ``first`` on and without the observer itself."""
    for other in range(first, first + n):
        if other != agent:
            dx, dy = offset_to(world, agent, other, rules)
            store(out, row, as_float(dx))
            store(out, row + 1, as_float(dy))
            row += 2
    return row


@rule
def _see_moves(
    world: World, moved: IntegerRows, agent: int, first: int, n: int, rules: Rules, out: FloatRows, row: int
) -> int:
    """Write the last moves of ``n`` agents, from the agent ``first`` on and without the observer itself."""
    for other in range(first, first + n):
        if other != agent:
            dx, dy = move_of(world, moved, agent, other, rules)
            store(out, row, as_float(dx))
            store(out, row + 1, as_float(dy))
            row += 2
    return row


@rule
def _sort(n_opponents: int, sight: Sight, out: FloatRows, offsets: int, moves: int) -> None:
    """Sort the opponents by distance, those at equal distances by index. Caught prey, whose offset is 0, come last."""
    for done in range(n_opponents):
        for i in range(n_opponents - 1 - done):
            here, there = _distance(out, offsets + 2 * i), _distance(out, offsets + 2 * i + 2)
            farther = (there > 0) & ((here > there) | (here == 0))
            _swap(out, offsets + 2 * i, farther)
            if sight.moves:
                _swap(out, moves + 2 * i, farther)


@rule
def _distance(out: FloatRows, row: int) -> Value:
    return manhattan(load(out, row), load(out, row + 1))


@rule
def _swap(out: FloatRows, row: int, which: Mask) -> None:
    """Swap the pair of rows from ``row`` on with the pair after it, where ``which`` holds."""
    for axis in range(2):
        one, other = load(out, row + axis), load(out, row + 2 + axis)
        store(out, row + axis, where(which, other, one))
        store(out, row + 2 + axis, where(which, one, other))
