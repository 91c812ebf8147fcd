"""Fitness of both teams as if the episode ended now (section V). One world at a time, in double precision."""

from __future__ import annotations

from predprey_env.config import Rules
from predprey_env.jit.compilation import rule
from predprey_env.jit.values import Array, Value
from predprey_env.rules.dynamics import World, count_alive
from predprey_env.rules.torus import displacement, largest_distance, manhattan

BEST = 25.0
"""Fitness of a predator team that caught all prey, and of a prey team that lost none."""

ALL, NEAREST = 1, 2  # indices in config.CLOSENESS


@rule
def distance(world: World, predator: int, prey: int, rules: Rules) -> Value:
    """Return the toroidal Manhattan distance from a predator to a prey, in steps; 0 for a caught prey."""
    if world.alive[prey] == 0:
        return 0
    agent = rules.n_predators + prey
    dx = displacement(world.x[predator], world.x[agent], rules.size)
    dy = displacement(world.y[predator], world.y[agent], rules.size)
    return manhattan(dx, dy)


@rule
def closeness(world: World, first: int, last: int, rules: Rules) -> float:
    """Return ``d`` of the predators ``first`` to ``last - 1``, in [0, 1].

    ``d`` is 1 minus their mean distance to the prey over the largest distance on the torus. The paper calls ``d`` "the
    normalized sum of distances". By default we read it as closeness to the prey that are still free: the fitness then
    increases with the number of prey caught, and with the paper's two prey it stays below 25 until all are caught.
    """
    total, terms = 0.0, 0
    for prey in range(rules.n_prey):
        if world.alive[prey] == 0 and rules.closeness != ALL:
            continue
        nearest = largest_distance(rules.size)
        for predator in range(first, last):
            steps = distance(world, predator, prey, rules)
            nearest = min(nearest, steps)
            if rules.closeness != NEAREST:
                total += steps
                terms += 1
        if rules.closeness == NEAREST:
            total += nearest
            terms += 1
    return 1.0 - total / (terms * largest_distance(rules.size))


@rule
def predator_fitness(world: World, first: int, last: int, rules: Rules) -> float:
    """Return 25 if all prey are caught, else ``20 g/n + 2 g + 20 d/n`` with ``g`` of ``n`` prey caught.

    The paper states the formula for its two prey. With four or more prey it can exceed 25 when only one is free.
    """
    n = rules.n_prey
    caught: int = n - count_alive(world, rules)
    if caught == n:
        return BEST
    return 20.0 * caught / n + 2.0 * caught + 20.0 * closeness(world, first, last, rules) / n


@rule
def prey_fitness(world: World, steps: int, rules: Rules) -> float:
    """Return 25 if no prey is caught, 12.5 if some are, and ``12.5 rho / R`` if all are.

    ``rho`` is the number of steps until the last prey was caught, ``R`` the time limit.
    """
    alive = count_alive(world, rules)
    if alive == rules.n_prey:
        return BEST
    if alive > 0:
        return BEST / 2
    return BEST / 2 * steps / rules.max_cycles


@rule
def fitness(world: World, steps: int, rules: Rules, out: Array) -> None:
    """Write every agent's fitness after ``steps`` steps to ``out``, float64 ``(n_agents,)``."""
    team = predator_fitness(world, 0, rules.n_predators, rules)
    for predator in range(rules.n_predators):
        own = rules.individual_credit
        out[predator] = predator_fitness(world, predator, predator + 1, rules) if own else team
    for prey in range(rules.n_prey):
        out[rules.n_predators + prey] = BEST - team if rules.complementary else prey_fitness(world, steps, rules)
