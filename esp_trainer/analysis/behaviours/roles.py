"""Detectors of the roles of predators, attacker and blocker.

Section VI.B: "Each predator agent assumed the role of either an attacker or blocker".
"""

from __future__ import annotations

from math import sqrt

from esp_trainer.analysis.behaviours.episode import (
    Episode,
    cosine,
    cross,
    distance_to_prey,
    extent,
    in_the_way,
    is_free,
    led_towards,
    offset,
    turned,
    was_free,
    way,
)
from esp_trainer.analysis.behaviours.thresholds import Thresholds
from predprey_env.jit import rule

ATTACKS, BLOCKS = 2, 1
_OPPOSED = -sqrt(0.5) + 1e-9  # cosine of 135 degrees; the margin is for rounding


@rule
def mark_roles(episode: Episode, x: Thresholds) -> None:
    """Mark in an episode which predators attack and which block which prey at which rows."""
    for row in range(episode.length + 1):
        for predator in range(episode.n_predators):
            for prey in range(episode.n_prey):
                if ends_attack(episode, row, predator, prey, x):
                    for earlier in range(row - x.chase, row + 1):
                        episode.attacks[earlier, predator, prey] = True
                if ends_block(episode, row, predator, prey, x):
                    for earlier in range(row - x.post, row + 1):
                        episode.blocks[earlier, predator, prey] = True


@rule
def ends_attack(episode: Episode, row: int, predator: int, prey: int, x: Thresholds) -> bool:
    """Return whether a predator has attacked a prey up to a row.

    "The role of an attacker is to chase the prey" (VI.B); "The attackers actively pursue the prey" (VII). All of these
    hold over ``chase`` steps; then the predator attacks at all rows of these steps:

    * All but ``slips`` of the predator's steps led towards where the prey was, the shortest way round.
    * At the end the predator is at most ``near`` away.
    * The predator reacted to the prey: it turned, or was near all the time, or was in line with the prey (in its row or
      column) all the time. Without this, a straight run past a prey would count.
    """
    if not was_free(episode, row, prey, x.chase) or distance_to_prey(episode, row, predator, prey) > x.near:
        return False
    first, led = row - x.chase, 0
    for each in range(first + 1, row + 1):
        led += led_towards(episode, each, predator, prey)
    if led < x.chase - x.slips:
        return False
    has_turned, in_line, near = False, True, distance_to_prey(episode, first, predator, prey) <= x.near
    for each in range(first + 1, row + 1):
        has_turned = has_turned or (each > first + 1 and turned(episode, each, predator))
        near = near and distance_to_prey(episode, each, predator, prey) <= x.near
        step, seen = way(episode, each - 1, each, predator), offset(episode, each - 1, predator, prey)
        in_line = in_line and cross(step, seen) == 0
    return has_turned or near or in_line


@rule
def ends_block(episode: Episode, row: int, predator: int, prey: int, x: Thresholds) -> bool:
    """Return whether a predator has blocked a prey up to a row.

    "the blocker moves in a localized area to obstruct the prey's path" (VI.B). All of these hold over ``post`` steps;
    then the predator blocks at all rows of these steps:

    * The predator stayed in a box of side ``area``.
    * At the end the prey runs towards it: the prey's last ``run`` steps went in one direction, and the predator is at
      most ``path`` ahead and at most ``lane`` to the side.
    """
    return (
        was_free(episode, row, prey, x.post)
        and in_the_way(episode, row, predator, prey, x.run, x.path, x.lane)
        and extent(episode, row, predator, x.post) <= x.area
    )


@rule
def role(episode: Episode, row: int, predator: int, prey: int) -> int:
    """Return the role of a predator towards a prey: ``ATTACKS``, ``BLOCKS`` or 0. A predator that does both attacks."""
    if episode.attacks[row, predator, prey]:
        return ATTACKS
    return BLOCKS if episode.blocks[row, predator, prey] else 0


@rule
def role_towards_any(episode: Episode, row: int, predator: int) -> int:
    """Return ``ATTACKS`` if a predator attacks any prey, else ``BLOCKS`` if it blocks any, else 0."""
    highest = 0
    for prey in range(episode.n_prey):
        highest = max(highest, role(episode, row, predator, prey))
    return highest


@rule
def anybody(episode: Episode, row: int, kind: int) -> bool:
    """Return whether any predator attacks any prey, or blocks any if ``kind`` is ``BLOCKS``."""
    for predator in range(episode.n_predators):
        for prey in range(episode.n_prey):
            if episode.attacks[row, predator, prey] if kind == ATTACKS else episode.blocks[row, predator, prey]:
                return True
    return False


@rule
def attacker(episode: Episode, row: int) -> bool:
    """Return whether any predator attacks any prey, see :func:`ends_attack`."""
    return anybody(episode, row, ATTACKS)


@rule
def blocker(episode: Episode, row: int) -> bool:
    """Return whether any predator blocks any prey, see :func:`ends_block`."""
    return anybody(episode, row, BLOCKS)


@rule
def role_switch(episode: Episode, row: int) -> bool:
    """Detect a predator whose role towards a prey differs from its last one.

    "the predators learn to dynamically switch roles [...] The blocker also starts to follow the prey when it tries to
    escape" (VI.B). Switches from attacker to blocker count as well. A predator that does both at once is an attacker.
    """
    for predator in range(episode.n_predators):
        for prey in range(episode.n_prey):
            now = role(episode, row, predator, prey)
            if row > 0 and now > 0:
                earlier = row - 1
                while earlier > 0 and role(episode, earlier, predator, prey) == 0:
                    earlier -= 1
                last = role(episode, earlier, predator, prey)
                if last > 0 and last != now:
                    return True
    return False


@rule
def opposing_attack(episode: Episode, row: int, x: Thresholds) -> bool:
    """Detect two attackers that come at a prey from opposing sides.

    "Two of them now approach the prey from opposing directions (acting as attackers)" (VI.B). Both attack (see
    :func:`ends_attack`), are at most ``near`` away, and their directions from the prey are at least 135 degrees apart.
    """
    for prey in range(episode.n_prey):
        for one in range(episode.n_predators):
            for other in range(one):
                if _closes_in(episode, row, one, prey, x) and _closes_in(episode, row, other, prey, x):
                    there, here = offset(episode, row, one, prey), offset(episode, row, other, prey)
                    if cosine(there, here) <= _OPPOSED:
                        return True
    return False


@rule
def _closes_in(episode: Episode, row: int, predator: int, prey: int, x: Thresholds) -> bool:
    """Return whether a predator that is near a free prey attacks it."""
    if not episode.attacks[row, predator, prey]:
        return False
    return is_free(episode, row, prey) and distance_to_prey(episode, row, predator, prey) <= x.near
