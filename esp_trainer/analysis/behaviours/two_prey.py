"""Detectors of behaviours that involve two prey (section VI.C)."""

from __future__ import annotations

from esp_trainer.analysis.behaviours.episode import (
    Episode,
    Vector,
    cosine,
    distance_to_prey,
    dot,
    is_free,
    is_free_around,
    nearest_distance,
    offset,
    reaches,
    way,
)
from esp_trainer.analysis.behaviours.thresholds import Thresholds
from predprey_env.jit import rule
from predprey_env.rules.torus import manhattan


@rule
def herding(episode: Episode, row: int, x: Thresholds) -> bool:
    """Detect two prey that have been driven together.

    The predators "first attempt to herd the prey" and "succeed in herding the prey and capturing them simultaneously"
    (VI.C). All of these hold over ``herd`` steps:

    * Two free prey came nearer to each other by ``gathered`` or more, to at most ``reach``.
    * In a fraction ``driven`` of the steps or more, both prey were driven: the nearest predator of each was at most
      ``reach`` away, on the side away from the other prey, as a shepherd is (Strombom et al., Solving the shepherding
      problem, 2014).
    """
    for one in range(episode.n_prey):
        for other in range(one):
            free = is_free(episode, row, one) and is_free(episode, row, other)
            if free and reaches(episode, row, x.herd, 0) and _are_herded(episode, row, one, other, x):
                return True
    return False


@rule
def _are_herded(episode: Episode, row: int, one: int, other: int, x: Thresholds) -> bool:
    """Return whether two prey came together, and both were driven for long enough."""
    partner = episode.n_predators + other
    apart = distance_to_prey(episode, row, partner, one)
    if apart > x.reach or distance_to_prey(episode, row - x.herd, partner, one) - apart < x.gathered:
        return False
    driven = 0
    for each in range(row - x.herd + 1, row + 1):
        inwards = offset(episode, each, partner, one)
        outwards = -inwards[0], -inwards[1]
        driven += _is_driven(episode, each, one, inwards, x.reach) and _is_driven(
            episode, each, other, outwards, x.reach
        )
    return driven >= x.driven * x.herd


@rule
def _is_driven(episode: Episode, row: int, prey: int, inwards: Vector, reach: int) -> bool:
    """Return whether a nearest predator of a prey is on the side away from a direction."""
    least = nearest_distance(episode, row, prey)
    if least > reach:
        return False
    for predator in range(episode.n_predators):
        outside = dot(offset(episode, row, predator, prey), inwards) < 0
        if outside and distance_to_prey(episode, row, predator, prey) == least:
            return True
    return False


@rule
def simultaneous_capture(episode: Episode, row: int, x: Thresholds) -> bool:
    """Detect two prey that are caught within ``together`` steps, at the row of the later capture.

    "capturing them simultaneously" (VI.C).
    """
    for later in range(episode.n_prey):
        if episode.capture_times[later] == row:
            for other in range(episode.n_prey):
                between = row - episode.capture_times[other]
                if other != later and between >= 0 and between <= x.together:
                    return True
    return False


@rule
def scattering(episode: Episode, row: int, x: Thresholds) -> bool:
    """Detect two prey that separate before predators that converge on them.

    "the prey evolve to scatter in different directions just before the predators converge on them" (VI.C). All of these
    hold:

    * Two free prey are at most ``near`` apart.
    * Two or more predators came nearer to the nearer of the two prey by ``approach`` over ``wait`` steps, to at most
      ``near``.
    * ``escape`` steps later both prey are free, and farther apart by ``escape`` or more.
    * In these steps each prey went at least half as far as it can, in directions at least 90 degrees apart.
    * At least one of the two turned by 90 degrees or more from its direction in the ``wait`` steps. So they did not
      merely cross each other's way.
    """
    for one in range(episode.n_prey):
        for other in range(one):
            if is_free_around(episode, row, one, x.wait, x.escape) and is_free_around(
                episode, row, other, x.wait, x.escape
            ):
                near = distance_to_prey(episode, row, episode.n_predators + other, one) <= x.near
                if near and _part(episode, row, one, other, x) and _are_converged_on(episode, row, one, other, x):
                    return True
    return False


@rule
def _are_converged_on(episode: Episode, row: int, one: int, other: int, x: Thresholds) -> bool:
    """Return whether two or more predators came near to a pair of prey."""
    converging = 0
    for predator in range(episode.n_predators):
        now = _distance_to_pair(episode, row, predator, one, other)
        before = _distance_to_pair(episode, row - x.wait, predator, one, other)
        converging += now <= x.near and before - now >= x.approach
    return converging >= 2


@rule
def _distance_to_pair(episode: Episode, row: int, predator: int, one: int, other: int) -> int:
    """Return the distance from a predator to the nearer of two prey, in steps."""
    return min(distance_to_prey(episode, row, predator, one), distance_to_prey(episode, row, predator, other))


@rule
def _part(episode: Episode, row: int, one: int, other: int, x: Thresholds) -> bool:
    """Return whether two prey separate, each by its own steps and one of them by a turn."""
    first, second = episode.n_predators + one, episode.n_predators + other
    if distance_to_prey(episode, row + x.escape, second, one) - distance_to_prey(episode, row, second, one) < x.escape:
        return False
    before, after = way(episode, row - x.wait, row, first), way(episode, row, row + x.escape, first)
    others_before, others_after = way(episode, row - x.wait, row, second), way(episode, row, row + x.escape, second)
    return (
        2 * manhattan(after[0], after[1]) >= x.escape
        and 2 * manhattan(others_after[0], others_after[1]) >= x.escape
        and cosine(after, others_after) <= 0
        and (dot(before, after) <= 0 or dot(others_before, others_after) <= 0)
    )
