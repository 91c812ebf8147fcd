"""Detectors of the ways in which a single prey evades predators (section VI.B)."""

from __future__ import annotations

from math import cos, radians

from esp_trainer.analysis.behaviours.episode import (
    Episode,
    Vector,
    approached,
    cosine,
    cross,
    distance_to_prey,
    dot,
    extent,
    in_the_way,
    is_free,
    is_free_around,
    led_towards,
    nearest_distance,
    offset,
    reaches,
    running,
    way,
)
from esp_trainer.analysis.behaviours.thresholds import Thresholds
from predprey_env.jit import rule
from predprey_env.rules.torus import manhattan

_AWAY = cos(radians(70))


@rule
def circling(episode: Episode, row: int, x: Thresholds) -> bool:
    """Detect a prey that has run round a small circle with a predator on its tail.

    "sometimes goes around in a small circle with the closest predator following on its tail" (VI.B). For some
    number of steps from 8 to ``circle``, a multiple of 4, all of these hold:

    * The prey's turns to the left and to the right differ by at least 4, once round.
    * The prey ends at most 2 cells from where it began.
    * One predator was at most ``tail`` away all the time, and three quarters of its steps led towards the prey.
    """
    for prey in range(episode.n_prey):
        if is_free(episode, row, prey):
            # From 8, not 4: the smallest circle has four steps, and a prey may go round it once by chance.
            for length in range(8, x.circle + 1, 4):
                if reaches(episode, row, length + 1, 0) and _goes_round(episode, row, prey, length):
                    for predator in range(episode.n_predators):
                        if _tails(episode, row, predator, prey, length, x.tail):
                            return True
    return False


@rule
def _goes_round(episode: Episode, row: int, prey: int, length: int) -> bool:
    """Return whether a prey went round once in ``length`` steps, and ends where it began."""
    agent = episode.n_predators + prey
    moved = way(episode, row - length, row, agent)
    if manhattan(moved[0], moved[1]) > 2:
        return False
    turns = 0
    for each in range(row - length + 1, row + 1):
        turns += cross(way(episode, each - 2, each - 1, agent), way(episode, each - 1, each, agent))
    return abs(turns) >= 4


@rule
def _tails(episode: Episode, row: int, predator: int, prey: int, length: int, tail: int) -> bool:
    """Return whether a predator was near a prey all the time, and mostly went towards it."""
    led = 0
    for each in range(row - length, row + 1):
        if distance_to_prey(episode, each, predator, prey) > tail:
            return False
        led += each > row - length and led_towards(episode, each, predator, prey)
    return 4 * led >= 3 * length


@rule
def baiting(episode: Episode, row: int, x: Thresholds) -> bool:
    """Detect a prey about to leave two predators that it let converge on it.

    "intelligent baiting behavior by waiting for the two predators to converge towards it before moving away in a
    direction opposite to that of the predators" (VI.B). All of these hold:

    * The prey waits. As it cannot stand still, this means that it stays in a box of side ``pause`` for ``wait`` steps.
    * In these steps, two predators come nearer by ``approach`` each, to at most ``converged``. Seen from the prey, they
      are at least 90 degrees apart.
    * In the next ``escape`` steps, the prey gets at least 0.8 times as far as it can, in a direction at least 70
      degrees off from where each of the two stood. It is free at the end.
    """
    for prey in range(episode.n_prey):
        if is_free_around(episode, row, prey, x.wait, x.escape):
            leaving = way(episode, row, row + x.escape, episode.n_predators + prey)
            far = manhattan(leaving[0], leaving[1]) >= 0.8 * x.escape
            if far and extent(episode, row, episode.n_predators + prey, x.wait) <= x.pause:
                for one in range(episode.n_predators):
                    for other in range(one):
                        apart = dot(offset(episode, row, one, prey), offset(episode, row, other, prey)) <= 0
                        if (
                            apart
                            and _is_baited(episode, row, one, prey, x)
                            and _is_baited(episode, row, other, prey, x)
                        ):
                            return True
    return False


@rule
def _is_baited(episode: Episode, row: int, predator: int, prey: int, x: Thresholds) -> bool:
    """Return whether a predator converges on a prey that is about to go elsewhere."""
    leaving = way(episode, row, row + x.escape, episode.n_predators + prey)
    return (
        distance_to_prey(episode, row, predator, prey) <= x.converged
        and approached(episode, row, predator, prey, x.wait) >= x.approach
        and cosine(offset(episode, row, predator, prey), leaving) <= _AWAY
    )


@rule
def sidestepping(episode: Episode, row: int, x: Thresholds) -> bool:
    """Detect a prey that runs at a blocker and is about to pass it on the side.

    "the prey learns to avoid the blocker by sidestepping as it crosses the blocker's path" (VI.B). All of these hold:

    * The prey has run ``run`` steps straight towards a predator that blocks it (see :func:`.roles.ends_block`) and is
      at most ``converged`` ahead and at most one cell to the side.
    * Within ``escape`` steps the predator is behind the prey and at most ``near`` to the side, and the prey is free.
    * The prey's own steps account for it: it went on in the direction in which it ran, to at least one cell before
      where the predator stood, with a shift to the side.
    """
    for predator in range(episode.n_predators):
        for prey in range(episode.n_prey):
            blocked = episode.blocks[row, predator, prey]
            if blocked and in_the_way(episode, row, predator, prey, x.run, x.converged, 1):
                for on in range(2, x.escape + 1):
                    if is_free_around(episode, row, prey, x.run, on) and _passes(episode, row, predator, prey, on, x):
                        return True
    return False


@rule
def _passes(episode: Episode, row: int, predator: int, prey: int, on: int, x: Thresholds) -> bool:
    """Return whether a running prey passes a predator within ``on`` steps, by its own steps."""
    direction = running(episode, row, prey, x.run)
    moved, after = way(episode, row, row + on, episode.n_predators + prey), offset(episode, row + on, predator, prey)
    return (
        dot(after, direction) < 0
        and dot(moved, direction) >= dot(offset(episode, row, predator, prey), direction) - 1
        and cross(direction, moved) != 0
        and abs(cross(after, direction)) <= x.near
    )


@rule
def reversal(episode: Episode, row: int, x: Thresholds) -> bool:
    """Detect a prey that turns round between predators and gains distance.

    "the prey learns to reverse its direction so that it avoids both the attackers and the blocker" (VI.B). All of these
    hold:

    * The prey has run ``run`` steps. After at most two further steps, which may go aside, it runs as many steps in the
      opposite direction.
    * When it turns, one predator is ahead and another behind, both at most ``reach`` away.
    * ``escape`` steps later the prey is free, and its nearest predator is farther away than when it turned.
    """
    for prey in range(episode.n_prey):
        if (
            is_free_around(episode, row, prey, x.run, x.escape)
            and _turns_round(episode, row, prey, x.run)
            and _is_between(episode, row, prey, running(episode, row, prey, x.run), x.reach)
            and nearest_distance(episode, row + x.escape, prey) > nearest_distance(episode, row, prey)
        ):
            return True
    return False


@rule
def _turns_round(episode: Episode, row: int, prey: int, run: int) -> bool:
    """Return whether a prey has run up to a row, and then runs the opposite way."""
    direction = running(episode, row, prey, run)
    for aside in range(3):
        later = row + run + aside
        if reaches(episode, row, 0, run + aside) and dot(direction, running(episode, later, prey, run)) < 0:
            return True
    return False


@rule
def _is_between(episode: Episode, row: int, prey: int, direction: Vector, reach: int) -> bool:
    """Return whether, along a direction, one predator is ahead of a prey and another behind it."""
    ahead, behind = False, False
    for predator in range(episode.n_predators):
        if distance_to_prey(episode, row, predator, prey) <= reach:
            forward = dot(offset(episode, row, predator, prey), direction)
            ahead = ahead or forward > 0
            behind = behind or forward < 0
    return ahead and behind
