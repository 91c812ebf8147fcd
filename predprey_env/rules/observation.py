"""Observations: the offsets to the opposing team. An agent sees nothing of its own team (section V)."""

from __future__ import annotations

from predprey_env.config import Rules
from predprey_env.jit.compilation import rule
from predprey_env.jit.floats import as_float
from predprey_env.jit.lanes import load, store, where
from predprey_env.jit.values import FloatRows
from predprey_env.rules.dynamics import World
from predprey_env.rules.torus import displacement


@rule
def observe(world: World, agent: int, rules: Rules, out: FloatRows, row: int) -> int:
    """Write an agent's observation to ``out``, float32, from ``row`` on, and return the row after it.

    The observation holds, for each opponent in order, its offset along x and along y: opponent minus self, the shortest
    way round the torus, in cells. The offset to or from a caught prey is (0, 0).
    """
    predator = agent < rules.n_predators
    first = rules.n_predators if predator else 0
    n_opponents = rules.n_prey if predator else rules.n_predators
    for opponent in range(first, first + n_opponents):
        prey = (opponent if predator else agent) - rules.n_predators
        free = load(world.alive, prey) != 0
        dx = displacement(load(world.x, agent), load(world.x, opponent), rules.size)
        dy = displacement(load(world.y, agent), load(world.y, opponent), rules.size)
        store(out, row, as_float(where(free, dx, 0)))
        store(out, row + 1, as_float(where(free, dy, 0)))
        row += 2
    return row
