"""What rules are written with and compiled by: values in lanes, exact float operations, a cache of machine code."""

from predprey_env.jit.compilation import entry_point, rule
from predprey_env.jit.lanes import LANES, any_of, load, store, where

__all__ = ["LANES", "any_of", "entry_point", "load", "rule", "store", "where"]
