"""Random numbers in compiled code from the caller's seed: the same in one world as in sixteen."""

from __future__ import annotations

import numpy as np

from predprey_env.jit.compilation import rule
from predprey_env.jit.floats import as_float
from predprey_env.jit.lanes import where
from predprey_env.jit.values import Value

_LOW_BITS = (1 << 31) - 1
_FACTOR = np.int64(1664525)  # 64 bits, because uncompiled NumPy would multiply by a 32-bit state in 32 bits
_UNIT = np.float32(2.0**-31)


@rule
def scramble(seed: int, agent: int) -> int:
    """Return the state from which an agent's choices start, in [0, 2**31): multiply-xorshift of both numbers."""
    bits = (seed + agent * 0x61C88647 + 0x2545F491) & _LOW_BITS
    bits = ((bits ^ (bits >> 15)) * 0x2C1B3C6D) & _LOW_BITS
    bits = ((bits ^ (bits >> 12)) * 0x297A2D39) & _LOW_BITS
    return bits ^ (bits >> 15)


@rule
def next_state(state: Value) -> Value:
    """Return the next state: a linear congruential generator modulo 2**31."""
    return (state * _FACTOR + 1013904223) & _LOW_BITS


@rule
def pick(state: Value, n: int) -> Value:
    """Return an integer in ``0 .. n - 1`` from the high bits of a state, because its low bits are hardly random."""
    part = (1 << 31) // n
    picked = where(state >= part, 1, 0)
    for k in range(2, n):
        picked = picked + where(state >= k * part, 1, 0)
    return picked


@rule
def unit_float(state: Value) -> Value:
    """Return a 32-bit float in [0, 1] from a state.

    It is 1 only for the last 64 of the 2**31 states, which round up to 1.
    """
    return as_float(state) * _UNIT
