"""Scripted predators. When no prey is free, they take the action of highest index, which is to idle if they may.

Sources: M. Benda, V. Jagannathan, R. Dodhiawala, *On Optimal Cooperation of Knowledge Sources* (Boeing, 1986), where a
prey is caught from its four sides; R. E. Korf, *A Simple Solution to Pursuit Games* (Workshop on Distributed Artificial
Intelligence, 1992). A script that names no source is this project's own.
"""

from __future__ import annotations

import numpy as np

from predprey_env.config import IDLE
from predprey_env.jit.compilation import rule
from predprey_env.jit.floats import as_float, as_integer
from predprey_env.jit.lanes import load, store, where
from predprey_env.jit.values import FloatRows, IntegerRows, Value
from predprey_env.policies.readings import FAR, nearest, towards
from predprey_env.rules.torus import magnitude

HALF, ZERO = np.float32(0.5), np.float32(0.0)


@rule
def greedy_chase(seen: FloatRows, n_opponents: int, n_actions: int) -> Value:
    """Run straight at the nearest free prey: Korf's attraction (1992), without his repulsion between predators."""
    dx, dy, length = nearest(seen, n_opponents)
    return where(length < FAR, towards(dx, dy), n_actions - 1)


@rule
def _in_step(length: Value, action: Value, n_actions: int, in_turns: bool) -> Value:
    """Return the action, or idle if the prey is an odd distance away (an even one where predators move after the prey).

    On an even torus, if all agents move, the parity of a distance never changes, and a predator that moves at the same
    time as the prey cannot land on it from an odd distance. Idling once corrects the parity.
    """
    if n_actions <= IDLE:
        return action
    return where(((as_integer(length) + in_turns) & 1) != 0, IDLE, action)


@rule
def parity_chase(seen: FloatRows, n_opponents: int, n_actions: int, in_turns: bool) -> Value:
    """Chase greedily, but idle when the nearest free prey is an odd distance away (an even one where teams move in
    turns). On a torus of even size this happens at most once for each prey that the predator turns to. A predator that
    may not idle plays the greedy chase.
    """
    dx, dy, length = nearest(seen, n_opponents)
    return where(length < FAR, _in_step(length, towards(dx, dy), n_actions, in_turns), n_actions - 1)


@rule
def intercept(seen: FloatRows, n_opponents: int, n_actions: int, in_turns: bool, memory: IntegerRows, at: int) -> Value:
    """Aim ahead of the nearest free prey (lead pursuit), at the place that it reaches if it repeats its last move for
    half as many steps as its distance. The predator idles as in :func:`parity_chase`.
    """
    dx, dy, length = nearest(seen, n_opponents)
    # Memory holds the offset expected if the prey stands still, so the difference is the prey's last move. A difference
    # that is not a single step means another prey, or a wrap around the torus: then there is no lead.
    vx, vy = dx - as_float(load(memory, at + 1)), dy - as_float(load(memory, at + 2))
    lead = where(magnitude(vx) + magnitude(vy) == 1, length * HALF, ZERO)
    action = _in_step(length, towards(dx + vx * lead, dy + vy * lead), n_actions, in_turns)
    action = where(length < FAR, action, n_actions - 1)
    store(memory, at + 1, as_integer(dx) - where(action == 0, 1, where(action == 1, -1, 0)))
    store(memory, at + 2, as_integer(dy) - where(action == 2, 1, where(action == 3, -1, 0)))
    return action


@rule
def surround(agent: int, seen: FloatRows, n_opponents: int, n_actions: int, in_turns: bool) -> Value:
    """Come from the west, the east, the south or the north, by the agent's index modulo 4 (the sides of Benda et al.,
    1986). The predator aims at a point on its own side of the nearest free prey, half as far from the prey as the
    predator is, and idles as in :func:`parity_chase`.
    """
    dx, dy, length = nearest(seen, n_opponents)
    role = agent % 4
    out = length * HALF
    aim_x, aim_y = dx, dy
    if role == 0:
        aim_x = dx - out
    elif role == 1:
        aim_x = dx + out
    elif role == 2:
        aim_y = dy - out
    else:
        aim_y = dy + out
    action = _in_step(length, towards(aim_x, aim_y), n_actions, in_turns)
    return where(length < FAR, action, n_actions - 1)
