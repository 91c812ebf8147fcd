"""A turn of a single world, compiled."""

from __future__ import annotations

from predprey_env.config import Rules
from predprey_env.jit.compilation import entry_point, rule
from predprey_env.jit.values import Array, FloatRows, IntegerRows
from predprey_env.rules.dynamics import World, is_over, remember_moves, take_turn
from predprey_env.rules.fitness import fitness
from predprey_env.rules.observation import observe
from predprey_env.sight import AnySight


@entry_point
def play_turn(
    world: World,
    moved: IntegerRows,
    actions: IntegerRows,
    turn: int,
    steps: int,
    rules: Rules,
    seen: FloatRows,
    scores: Array,
) -> bool:
    """Play a turn; write last moves, observations and fitness, and return whether the episode ends."""
    take_turn(world, actions, turn, rules)
    remember_moves(actions, turn, rules, moved)
    observe_all(world, moved, rules, rules.sight, seen)
    fitness(world, steps, rules, scores)
    return is_over(world, steps, rules)


@rule
def observe_all(world: World, moved: IntegerRows, rules: Rules, sight: AnySight, seen: FloatRows) -> None:
    """Write every agent's observation to ``seen``, one after the other."""
    row = 0
    for agent in range(rules.n_predators + rules.n_prey):
        row = observe(sight, world, moved, agent, rules, seen, row)


@entry_point
def observe_with(world: World, moved: IntegerRows, rules: Rules, sight: AnySight, seen: FloatRows) -> None:
    """Write what every agent would observe with a sight to ``seen``, one after the other."""
    observe_all(world, moved, rules, sight, seen)
