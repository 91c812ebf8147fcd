"""Random choices in compiled code, from a seed that the caller draws: the same in one world and in sixteen."""

from __future__ import annotations

from typing import Any

import numpy as np

from predprey_env.compilation import rule
from predprey_env.floats import as_float
from predprey_env.lanes import where

_LOW_BITS = (1 << 31) - 1
_FACTOR = np.int64(1664525)  # of 64 bits: where nothing is compiled, NumPy would multiply a state in 32
_UNIT = np.float32(2.0**-31)


@rule
def scramble(seed: int, agent: int) -> int:
    """The state that an agent's choices start from, in [0, 2**31): multiply-xorshift rounds over both numbers."""
    bits = (seed + agent * 0x61C88647 + 0x2545F491) & _LOW_BITS
    bits = ((bits ^ (bits >> 15)) * 0x2C1B3C6D) & _LOW_BITS
    bits = ((bits ^ (bits >> 12)) * 0x297A2D39) & _LOW_BITS
    return bits ^ (bits >> 15)


@rule
def advance(state: Any) -> Any:
    """The state after one: a linear congruential generator modulo 2**31."""
    return (state * _FACTOR + 1013904223) & _LOW_BITS


@rule
def pick(state: Any, n: int) -> Any:
    """A number in ``0 .. n - 1`` from the high bits of a state, which are the random ones."""
    part = (1 << 31) // n
    picked = where(state >= part, 1, 0)
    for k in range(2, n):
        picked = picked + where(state >= k * part, 1, 0)
    return picked


@rule
def share(state: Any) -> Any:
    """A 32-bit float in [0, 1] from a state; it is 1 just for the last 64 of 2**31 states, which round up to it."""
    return as_float(state) * _UNIT
