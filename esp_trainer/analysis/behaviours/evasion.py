"""Detectors of the ways in which a single prey evades predators (section VI.B)."""

from __future__ import annotations

import numpy as np

from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.behaviours.roles import blocks, in_the_way, running, towards
from esp_trainer.analysis.behaviours.thresholds import Thresholds
from esp_trainer.analysis.behaviours.windows import ago, ahead, cosine, cross, dot, extent, steps, total


def circling(paths: Paths, thresholds: Thresholds) -> np.ndarray:
    """Detect a prey that has run round a small circle with a predator on its tail: rows, bool ``(n_episodes, n_rows)``.

    "sometimes goes around in a small circle with the closest predator following on its tail" (VI.B). For some
    number of steps from 8 to ``circle``, a multiple of 4, all of these hold:

    * The prey's turns to the left and to the right differ by at least 4, once round.
    * The prey ends at most 2 cells from where it began.
    * One predator was at most ``tail`` away all the time, and three quarters of its steps led towards the prey.
    """
    moves = steps(paths.prey)
    turns = cross(ago(moves, 1), moves)
    close, on_it = paths.distances <= thresholds.tail, towards(paths)
    found = np.zeros(paths.alive.shape, bool)
    # From 8, not 4: the smallest circle has four steps, and once round it may be chance.
    for length in range(8, thresholds.circle + 1, 4):
        round_once = np.abs(total(turns, length)) >= 4
        closed = np.abs(paths.prey - ago(paths.prey, length)).sum(axis=3) <= 2
        tailed = (total(close, length + 1) > length) & (4 * total(on_it, length) >= 3 * length)
        found |= round_once & closed & tailed.any(axis=2) & paths.reaches(back=length + 1)[:, :, None]
    return np.asarray((found & paths.alive).any(axis=2))


def baiting(paths: Paths, thresholds: Thresholds) -> np.ndarray:
    """Detect a prey about to leave two predators that it let converge on it: rows, bool ``(n_episodes, n_rows)``.

    "intelligent baiting behavior by waiting for the two predators to converge towards it before moving away in a
    direction opposite to that of the predators" (VI.B). All of these hold:

    * The prey waits. As it cannot stand still, this means that it stays in a box of side ``pause`` for ``wait`` steps.
    * In these steps, two predators come nearer by ``approach`` each, to at most ``converged``. Seen from the prey, they
      are at least 90 degrees apart.
    * In the next ``escape`` steps, the prey gets at least 0.8 times as far as it can, in a direction at least 70
      degrees off from where each of the two stood. It is free at the end.
    """
    on = thresholds.escape
    waits = (extent(paths.prey, thresholds.wait) <= thresholds.pause) & _free(paths, thresholds.wait, on)
    way = ahead(paths.prey, on) - paths.prey
    leaves = np.abs(way).sum(axis=3) >= 0.8 * on
    nearer = ago(paths.distances, thresholds.wait) - paths.distances
    converges = (nearer >= thresholds.approach) & (paths.distances <= thresholds.converged)
    avoids = cosine(paths.offsets, way[:, :, None]) <= np.cos(np.radians(70))
    baited = converges & avoids & (waits & leaves)[:, :, None]
    found = np.zeros(waits.shape, bool)
    for one in range(paths.n_predators):
        for other in range(one):
            apart = dot(paths.offsets[:, :, one], paths.offsets[:, :, other]) <= 0
            found |= baited[:, :, one] & baited[:, :, other] & apart
    return np.asarray(found.any(axis=2))


def sidestepping(paths: Paths, thresholds: Thresholds) -> np.ndarray:
    """Detect a prey that runs at a blocker and is about to pass it on the side: rows, bool ``(n_episodes, n_rows)``.

    "the prey learns to avoid the blocker by sidestepping as it crosses the blocker's path" (VI.B). All of these hold:

    * The prey has run ``run`` steps straight towards a predator that blocks it (see :func:`.roles.blocks`) and is at
      most ``converged`` ahead and at most one cell to the side.
    * Within ``escape`` steps the predator is behind the prey and at most ``near`` to the side, and the prey is free.
    * The prey's own steps account for it: it went on in the direction in which it ran, to at least one cell before
      where the predator stood, with a shift to the side.
    """
    direction = running(paths, thresholds.run)[:, :, None]
    forward = dot(paths.offsets, direction)
    ready = in_the_way(paths, thresholds.run, thresholds.converged, 1) & blocks(paths, thresholds)
    found = np.zeros(ready.shape, bool)
    for on in range(2, thresholds.escape + 1):
        way = (ahead(paths.prey, on) - paths.prey)[:, :, None]
        past = dot(ahead(paths.offsets, on), direction) < 0
        own = dot(way, direction) >= forward - 1
        aside = cross(direction, way) != 0
        beside = np.abs(cross(ahead(paths.offsets, on), direction)) <= thresholds.near
        found |= ready & past & own & aside & beside & _free(paths, thresholds.run, on)[:, :, None]
    return np.asarray(found.any(axis=(2, 3)))


def reversal(paths: Paths, thresholds: Thresholds) -> np.ndarray:
    """Detect a prey that turns round between predators and gains distance: rows, bool ``(n_episodes, n_rows)``.

    "the prey learns to reverse its direction so that it avoids both the attackers and the blocker" (VI.B). All of these
    hold:

    * The prey has run ``run`` steps. After at most two further steps, which may go aside, it runs as many steps in the
      opposite direction.
    * When it turns, one predator is ahead and another behind, both at most ``reach`` away.
    * ``escape`` steps later the prey is free, and its nearest predator is farther away than when it turned.
    """
    direction = running(paths, thresholds.run)
    turned = np.zeros(paths.alive.shape, bool)
    for aside in range(3):
        after = ahead(direction, thresholds.run + aside)
        turned |= (dot(direction, after) < 0) & paths.reaches(on=thresholds.run + aside)[:, :, None]
    forward = dot(paths.offsets, direction[:, :, None])
    there = paths.distances <= thresholds.reach
    between = (there & (forward > 0)).any(axis=2) & (there & (forward < 0)).any(axis=2)
    nearest = paths.distances.min(axis=2)
    gains = ahead(nearest, thresholds.escape) > nearest
    return np.asarray((turned & between & gains & _free(paths, thresholds.run, thresholds.escape)).any(axis=2))


def _free(paths: Paths, back: int, on: int) -> np.ndarray:
    """Return at which rows a prey is free from ``back`` rows earlier to ``on`` rows later, bool
    ``(n_episodes, n_rows, n_prey)``.
    """
    return np.asarray(ahead(paths.alive, on) & paths.reaches(back, on)[:, :, None])
