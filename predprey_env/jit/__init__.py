"""Tools to write and compile rules: values in lanes, exact float operations, a cache of machine code."""

from predprey_env.jit.compilation import entry_point, rule
from predprey_env.jit.floats import add_products, as_float, bits_of, float_of, fma, zeros
from predprey_env.jit.lanes import LANES, any_of, load, store, where

__all__ = [
    "LANES",
    "add_products",
    "any_of",
    "as_float",
    "bits_of",
    "entry_point",
    "float_of",
    "fma",
    "load",
    "rule",
    "store",
    "where",
    "zeros",
]
