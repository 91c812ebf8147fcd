"""Scripted prey.

Sources: T. Haynes, S. Sen, *Evolving Behavioral Strategies in Predators and Prey* (IJCAI-95 Workshop on Adaptation and
Learning in Multiagent Systems, 1995); C. H. Yong, R. Miikkulainen, *Cooperative Coevolution of Multi-Agent Systems*
(University of Texas at Austin, AI01-287, 2001). A script that names no source is this project's own.
"""

from __future__ import annotations

from predprey_env.jit.compilation import rule
from predprey_env.jit.lanes import load, store, where
from predprey_env.jit.values import FloatRows, IntegerRows, Value
from predprey_env.policies.readings import nearest, towards


@rule
def flee_nearest(seen: FloatRows, n_opponents: int) -> Value:
    """Run straight away from the nearest predator: the fixed prey of Yong & Miikkulainen (2001)."""
    dx, dy, _ = nearest(seen, n_opponents)
    return towards(0 - dx, 0 - dy)


@rule
def flee_centroid(seen: FloatRows, n_opponents: int) -> Value:
    """Run away from the predators' centroid, which is the mean of the shortest offsets to them."""
    dx, dy = load(seen, 0), load(seen, 1)
    for opponent in range(1, n_opponents):
        dx, dy = dx + load(seen, 2 * opponent), dy + load(seen, 2 * opponent + 1)
    return towards(0 - dx, 0 - dy)


@rule
def run_straight(seen: FloatRows, n_opponents: int, memory: IntegerRows, at: int) -> Value:
    """Run away from the nearest predator at the start and never turn, so that predators behind stay behind. Based on
    the linear prey of Haynes & Sen (1995), whose direction is random.
    """
    kept = load(memory, at + 1)  # direction + 1; 0 before the first move
    direction = where(kept > 0, kept - 1, flee_nearest(seen, n_opponents))
    store(memory, at + 1, direction + 1)
    return direction
