"""Scripted predators. Where none is left to hunt they take their last action, which is to idle if they may.

Sources: M. Benda, V. Jagannathan, R. Dodhiawala, *On Optimal Cooperation of Knowledge Sources* (Boeing, 1986), where a
prey is caught from its four sides; R. E. Korf, *A Simple Solution to Pursuit Games* (Workshop on Distributed Artificial
Intelligence, 1992). What names no source is this project's own.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from predprey_env.compilation import rule
from predprey_env.config import IDLE
from predprey_env.floats import as_float, as_integer
from predprey_env.lanes import load, store, where
from predprey_env.policies.sight import FAR, nearest, towards
from predprey_env.torus import magnitude

HALF, ZERO = np.float32(0.5), np.float32(0.0)


@rule
def greedy_chase(seen: Any, n_opponents: int, n_actions: int) -> Any:
    """It runs straight at the nearest free prey: Korf's attraction (1992), without his repulsion between predators."""
    dx, dy, length = nearest(seen, n_opponents)
    return where(length < FAR, towards(dx, dy), n_actions - 1)


@rule
def _in_step(length: Any, action: Any, n_actions: int, in_turns: bool) -> Any:
    """The action, or a rest where the prey is an odd distance away: on an even torus, where all move, that would never
    change, and nobody lands on a prey from an odd distance. Where predators move after the prey it is the even ones.
    """
    if n_actions <= IDLE:
        return action
    return where(((as_integer(length) + in_turns) & 1) != 0, IDLE, action)


@rule
def parity_chase(seen: Any, n_opponents: int, n_actions: int, in_turns: bool) -> Any:
    """The greedy chase, but it idles whenever the nearest free prey is an odd distance away (where teams move in turns,
    an even one): once for each prey that it turns to. Where it may not idle it is the greedy chase.
    """
    dx, dy, length = nearest(seen, n_opponents)
    return where(length < FAR, _in_step(length, towards(dx, dy), n_actions, in_turns), n_actions - 1)


@rule
def intercept(seen: Any, n_opponents: int, n_actions: int, in_turns: bool, memory: Any, at: int) -> Any:
    """It aims ahead of the nearest free prey: where it will be, if it goes on as it just went, after half as many steps
    as it is away (lead pursuit); it keeps step as :func:`parity_chase` does.
    """
    dx, dy, length = nearest(seen, n_opponents)
    # What it would see now if the prey had stood still; a change by more than a step is another prey, or the far side.
    vx, vy = dx - as_float(load(memory, at + 1)), dy - as_float(load(memory, at + 2))
    lead = where(magnitude(vx) + magnitude(vy) == 1, length * HALF, ZERO)
    action = _in_step(length, towards(dx + vx * lead, dy + vy * lead), n_actions, in_turns)
    action = where(length < FAR, action, n_actions - 1)
    store(memory, at + 1, as_integer(dx) - where(action == 0, 1, where(action == 1, -1, 0)))
    store(memory, at + 2, as_integer(dy) - where(action == 2, 1, where(action == 3, -1, 0)))
    return action


@rule
def surround(agent: int, seen: Any, n_opponents: int, n_actions: int, in_turns: bool) -> Any:
    """Four roles, one for each agent in turn: to come from the west, the east, the south or the north (the sides of
    Benda et al., 1986). It aims beside the nearest free prey, on its own side, half as far out as it is away; it keeps
    step as :func:`parity_chase` does.
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
