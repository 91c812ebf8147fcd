"""Detector of predators that surround a prey."""

from __future__ import annotations

from esp_trainer.analysis.behaviours.episode import (
    Episode,
    Vector,
    approached,
    cross,
    distance_to_prey,
    is_free_around,
    offset,
)
from esp_trainer.analysis.behaviours.thresholds import Thresholds
from predprey_env.jit import rule


@rule
def encirclement(episode: Episode, row: int, x: Thresholds) -> bool:
    """Detect a free prey that is surrounded.

    "they need to surround the prey from different sides so that they do not have anywhere to escape before they can
    catch them" (III). All of these hold:

    * Three or more predators are at most ``near`` away.
    * Seen from the prey, every gap between these predators is narrower than 180 degrees. So the prey is inside their
      convex hull, as in most definitions of target enclosing.
    * Over ``wait`` steps, these predators came nearer by ``approach`` on average.
    """
    for prey in range(episode.n_prey):
        if is_free_around(episode, row, prey, x.wait, 0):
            n_near, closer = 0, 0
            for predator in range(episode.n_predators):
                if distance_to_prey(episode, row, predator, prey) <= x.near:
                    n_near += 1
                    closer += approached(episode, row, predator, prey, x.wait)
            if n_near >= 3 and closer >= x.approach * n_near and _is_enclosed(episode, row, prey, x.near):
                return True
    return False


@rule
def _is_enclosed(episode: Episode, row: int, prey: int, near: int) -> bool:
    """Return whether every near predator has another near one to its left, by less than 180 degrees."""
    for predator in range(episode.n_predators):
        if distance_to_prey(episode, row, predator, prey) <= near:
            followed = False
            for other in range(episode.n_predators):
                if distance_to_prey(episode, row, other, prey) <= near:
                    here, there = _direction(episode, row, predator, prey), _direction(episode, row, other, prey)
                    followed = followed or cross(here, there) > 0
            if not followed:
                return False
    return True


@rule
def _direction(episode: Episode, row: int, predator: int, prey: int) -> Vector:
    """Return the displacement from a prey to a predator."""
    # Only in re-paired episodes can a predator be in a free prey's cell. Then it is counted as in the east, like the
    # angle of a vector of length 0.
    return (1, 0) if distance_to_prey(episode, row, predator, prey) == 0 else offset(episode, row, predator, prey)
