"""Detectors of the roles of predators, attacker and blocker.

Section VI.B: "Each predator agent assumed the role of either an attacker or blocker".
"""

from __future__ import annotations

import numpy as np

from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.behaviours.thresholds import Thresholds
from esp_trainer.analysis.behaviours.windows import ago, cosine, cross, dot, extent, spread_back, steps, total


def attacks(paths: Paths, thresholds: Thresholds) -> np.ndarray:
    """Return which predators attack which prey at which rows, bool ``(n_episodes, n_rows, n_predators, n_prey)``.

    "The role of an attacker is to chase the prey" (VI.B); "The attackers actively pursue the prey" (VII). All of these
    hold over ``chase`` steps, all of whose rows then count:

    * All but ``slips`` of the predator's steps led towards where the prey was, the shortest way round.
    * At the end the predator is at most ``near``.
    * The predator reacted to the prey: it turned, or was near all the time, or was in line with the prey (in its row or
      column) all the time. Without this, a straight run past a prey would count.
    """
    moves = steps(paths.predators)
    straight = (moves == ago(moves, 1)).all(axis=3)
    seen = ago(paths.offsets, 1)
    near = paths.distances <= thresholds.near
    answers = [
        (total(~straight, thresholds.chase - 1) > 0)[..., None] & np.ones_like(near),
        total(near, thresholds.chase + 1) > thresholds.chase,
        total(cross(moves[:, :, :, None], seen) == 0, thresholds.chase) == thresholds.chase,
    ]
    chasing = total(towards(paths), thresholds.chase) >= thresholds.chase - thresholds.slips
    found = chasing & near & np.logical_or.reduce(answers) & _hunted(paths, thresholds.chase)
    return spread_back(found, thresholds.chase)


def blocks(paths: Paths, thresholds: Thresholds) -> np.ndarray:
    """Return which predators block which prey at which rows, bool ``(n_episodes, n_rows, n_predators, n_prey)``.

    "the blocker moves in a localized area to obstruct the prey's path" (VI.B). All of these hold over ``post`` steps,
    all of whose rows then count:

    * The predator stayed in a box of side ``area``.
    * At the end the prey runs towards it: the prey's last ``run`` steps went in one direction, and the predator is at
      most ``path`` ahead and at most ``lane`` to the side.
    """
    localized = extent(paths.predators, thresholds.post) <= thresholds.area
    found = (
        localized[..., None]
        & in_the_way(paths, thresholds.run, thresholds.path, thresholds.lane)
        & _hunted(paths, thresholds.post)
    )
    return spread_back(found, thresholds.post)


def attacker(paths: Paths, thresholds: Thresholds) -> np.ndarray:
    """Return the rows at which any predator attacks any prey, see :func:`attacks`: bool ``(n_episodes, n_rows)``."""
    return np.asarray(attacks(paths, thresholds).any(axis=(2, 3)))


def blocker(paths: Paths, thresholds: Thresholds) -> np.ndarray:
    """Return the rows at which any predator blocks any prey, see :func:`blocks`: bool ``(n_episodes, n_rows)``."""
    return np.asarray(blocks(paths, thresholds).any(axis=(2, 3)))


def role_switch(paths: Paths, thresholds: Thresholds) -> np.ndarray:
    """Detect a predator whose role towards a prey differs from its last one: rows, bool ``(n_episodes, n_rows)``.

    "the predators learn to dynamically switch roles [...] The blocker also starts to follow the prey when it tries to
    escape" (VI.B). Switches from attacker to blocker count as well. A predator that does both at once is an attacker.
    """
    attacking = attacks(paths, thresholds)
    role = np.where(attacking, 2, np.where(blocks(paths, thresholds), 1, 0))
    rows = np.arange(paths.n_rows)[:, None, None]
    latest = np.maximum.accumulate(np.where(role > 0, rows, 0), axis=1)  # latest row at which it had a role
    last = ago(np.take_along_axis(role, latest, axis=1), 1)
    last[:, 0] = 0
    return np.asarray(((role > 0) & (last > 0) & (role != last)).any(axis=(2, 3)))


def opposing_attack(paths: Paths, thresholds: Thresholds) -> np.ndarray:
    """Detect two attackers that come at a prey from opposing sides: rows, bool ``(n_episodes, n_rows)``.

    "Two of them now approach the prey from opposing directions (acting as attackers)" (VI.B). Both attack (see
    :func:`attacks`) and are at most ``near``, and their directions from the prey are at least 135 degrees apart.
    """
    ready = attacks(paths, thresholds) & (paths.distances <= thresholds.near) & paths.alive[:, :, None]
    found = np.zeros(ready.shape[:2], bool)
    for one in range(paths.n_predators):
        for other in range(one):
            apart = cosine(paths.offsets[:, :, one], paths.offsets[:, :, other]) <= -np.sqrt(0.5) + 1e-9
            found |= (ready[:, :, one] & ready[:, :, other] & apart).any(axis=2)
    return found


def towards(paths: Paths) -> np.ndarray:
    """Return which predators' last step led towards the cell in which the prey was before it, bool
    ``(n_episodes, n_rows, n_predators, n_prey)``.
    """
    return dot(steps(paths.predators)[:, :, :, None], ago(paths.offsets, 1)) < 0


def running(paths: Paths, run: int) -> np.ndarray:
    """Return the direction of each prey's last ``run`` steps if they all went the same way, else 0: int32
    ``(n_episodes, n_rows, n_prey, 2)``.
    """
    moves = steps(paths.prey)
    turned = (moves != ago(moves, 1)).any(axis=3)
    straight = (total(turned, run - 1) == 0) & paths.reaches(back=run)[:, :, None]
    return np.asarray(moves * straight[..., None])


def in_the_way(paths: Paths, run: int, path: int, lane: int) -> np.ndarray:
    """Return which predators are in the way of which prey, bool ``(n_episodes, n_rows, n_predators, n_prey)``.

    The prey has run ``run`` steps in one direction, and the predator is at most ``path`` ahead of it and at most
    ``lane`` to the side of its line.
    """
    direction = running(paths, run)[:, :, None]
    forward, aside = dot(paths.offsets, direction), np.abs(cross(paths.offsets, direction))
    return np.asarray((forward > 0) & (forward <= path) & (aside <= lane))


def _hunted(paths: Paths, rows: int) -> np.ndarray:
    """Return at which rows a prey was free for the ``rows`` rows before, bool ``(n_episodes, n_rows, 1, n_prey)``."""
    # Prey are never freed, so a prey that was free one row earlier was free at all rows before that one too.
    return np.asarray(ago(paths.alive, 1) & paths.reaches(back=rows)[:, :, None])[:, :, None]
