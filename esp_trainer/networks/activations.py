"""Arithmetic of networks: a weighted sum, the logistic and the exponential function in 32-bit floats."""

from __future__ import annotations

import numpy as np

from predprey_env.jit.compilation import rule
from predprey_env.jit.floats import ROUNDER, fma, power_of_two
from predprey_env.jit.lanes import load, where
from predprey_env.jit.values import FloatRows, Value

ONE = np.float32(1)
LOG2_E = np.float32(1.4426950408889634)
BOUND = np.float32(44.0)
# Minimax coefficients of 2**f on [-1/2, 1/2] (Remez); relative error below 2e-7.
_C1, _C2, _C3 = np.float32(0.693146944), np.float32(0.240221202), np.float32(0.055507131)
_C4, _C5 = np.float32(0.009675541), np.float32(0.001327647)


@rule
def weighted_sum(weights: FloatRows, at: int, inputs: FloatRows, n_inputs: int) -> Value:
    """Return the sum of at least two inputs, times the weights from row ``at`` on."""
    z = fma(load(weights, at + 1), load(inputs, 1), load(weights, at) * load(inputs, 0))
    for i in range(2, n_inputs):
        z = fma(load(weights, at + i), load(inputs, i), z)
    return z


@rule
def logistic(z: Value) -> Value:
    """Return ``1 / (1 + exp(-z))`` in 32-bit floats, without a library call; the error is below 2e-7.

    Inputs beyond 44 or -44 count as that bound. There the true value differs from 0 or 1 by less than 1e-19, and
    smaller activations would lead to denormal products, which are many times slower.
    """
    z = where(z < -BOUND, -BOUND, z)
    z = where(z > BOUND, BOUND, z)
    shifted = fma(z, -LOG2_E, ROUNDER)
    power = _fraction_of_power(fma(z, -LOG2_E, ROUNDER - shifted))
    return ONE / fma(power, power_of_two(shifted), ONE)


@rule
def exponential(z: Value) -> Value:
    """Return ``exp(z)`` for z up to 0 in 32-bit floats, without a library call. Inputs below -44 count as -44."""
    z = where(z < -BOUND, -BOUND, z)
    shifted = fma(z, LOG2_E, ROUNDER)
    return _fraction_of_power(fma(z, LOG2_E, ROUNDER - shifted)) * power_of_two(shifted)


@rule
def _fraction_of_power(f: Value) -> Value:
    """Return ``2 ** f`` for f in [-1/2, 1/2]."""
    return fma(fma(fma(fma(fma(f, _C5, _C4), f, _C3), f, _C2), f, _C1), f, ONE)
