"""What predators are to a prey: attackers and blockers (section VI.B: "Each predator agent assumed the role of either
an attacker or blocker").
"""

from __future__ import annotations

import numpy as np

from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.behaviours.thresholds import Thresholds
from esp_trainer.analysis.behaviours.windows import ago, cosine, cross, dot, extent, spread_back, steps, total


def attacks(paths: Paths, thresholds: Thresholds) -> np.ndarray:
    """Who attacks whom when, bool ``(n_episodes, n_rows, n_predators, n_prey)``.

    "The role of an attacker is to chase the prey" (VI.B); "The attackers actively pursue the prey" (VII). For ``chase``
    steps, all but ``slips`` of the predator's steps went towards where the prey was, the shortest way round, and at the
    end it is at most ``near``. A straight run past a prey looks like that for a while, so there must also be a sign
    that the predator answers to the prey: it turned, or was near all the time, or ran at it in its very row or column
    all the time. All rows of such a stretch count.
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
    """Who blocks whom when, bool ``(n_episodes, n_rows, n_predators, n_prey)``.

    "the blocker moves in a localized area to obstruct the prey's path" (VI.B). For ``post`` steps the predator kept to
    a box of side ``area``; at the end the prey runs at it: the prey's last ``run`` steps went the same way, and the
    predator is at most ``path`` ahead and at most ``lane`` to the side. All rows of the predator's stay count.
    """
    localized = extent(paths.predators, thresholds.post) <= thresholds.area
    found = (
        localized[..., None]
        & in_the_way(paths, thresholds.run, thresholds.path, thresholds.lane)
        & _hunted(paths, thresholds.post)
    )
    return spread_back(found, thresholds.post)


def attacker(paths: Paths, thresholds: Thresholds) -> np.ndarray:
    """Rows at which some predator attacks some prey: see :func:`attacks`."""
    return np.asarray(attacks(paths, thresholds).any(axis=(2, 3)))


def blocker(paths: Paths, thresholds: Thresholds) -> np.ndarray:
    """Rows at which some predator blocks some prey: see :func:`blocks`."""
    return np.asarray(blocks(paths, thresholds).any(axis=(2, 3)))


def role_switch(paths: Paths, thresholds: Thresholds) -> np.ndarray:
    """Rows at which a predator takes another role towards a prey than it had last, for any predator and prey.

    "the predators learn to dynamically switch roles [...] The blocker also starts to follow the prey when it tries to
    escape" (VI.B); either way round counts. While it does both, it attacks.
    """
    attacking = attacks(paths, thresholds)
    role = np.where(attacking, 2, np.where(blocks(paths, thresholds), 1, 0))
    rows = np.arange(paths.n_rows)[:, None, None]
    latest = np.maximum.accumulate(np.where(role > 0, rows, 0), axis=1)  # the row of the role that it had last
    last = ago(np.take_along_axis(role, latest, axis=1), 1)
    last[:, 0] = 0
    return np.asarray(((role > 0) & (last > 0) & (role != last)).any(axis=(2, 3)))


def opposing_attack(paths: Paths, thresholds: Thresholds) -> np.ndarray:
    """Rows at which two attackers of a prey come from opposing sides.

    "Two of them now approach the prey from opposing directions (acting as attackers)" (VI.B). Both attack (see
    :func:`attacks`), are at most ``near``, and are seen from the prey at least 135 degrees apart.
    """
    ready = attacks(paths, thresholds) & (paths.distances <= thresholds.near) & paths.alive[:, :, None]
    found = np.zeros(ready.shape[:2], bool)
    for one in range(paths.n_predators):
        for other in range(one):
            apart = cosine(paths.offsets[:, :, one], paths.offsets[:, :, other]) <= -np.sqrt(0.5) + 1e-9
            found |= (ready[:, :, one] & ready[:, :, other] & apart).any(axis=2)
    return found


def towards(paths: Paths) -> np.ndarray:
    """Whether a predator's step to a row led nearer to where a prey was, bool
    ``(n_episodes, n_rows, n_predators, n_prey)``.
    """
    return dot(steps(paths.predators)[:, :, :, None], ago(paths.offsets, 1)) < 0


def running(paths: Paths, run: int) -> np.ndarray:
    """The direction of each prey's last ``run`` steps, if they all went the same way, else 0: int32
    ``(n_episodes, n_rows, n_prey, 2)``.
    """
    moves = steps(paths.prey)
    turned = (moves != ago(moves, 1)).any(axis=3)
    straight = (total(turned, run - 1) == 0) & paths.reaches(back=run)[:, :, None]
    return np.asarray(moves * straight[..., None])


def in_the_way(paths: Paths, run: int, path: int, lane: int) -> np.ndarray:
    """Which predators are at most ``path`` ahead of a prey that has run ``run`` steps and at most ``lane`` to the side
    of its line: bool ``(n_episodes, n_rows, n_predators, n_prey)``.
    """
    direction = running(paths, run)[:, :, None]
    forward, aside = dot(paths.offsets, direction), np.abs(cross(paths.offsets, direction))
    return np.asarray((forward > 0) & (forward <= path) & (aside <= lane))


def _hunted(paths: Paths, rows: int) -> np.ndarray:
    """Rows of the episode before which a prey was free for so many, ``(n_episodes, n_rows, 1, n_prey)``."""
    return np.asarray(ago(paths.alive, 1) & paths.reaches(back=rows)[:, :, None])[:, :, None]
