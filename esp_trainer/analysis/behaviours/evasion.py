"""What one prey does to get away (section VI.B)."""

from __future__ import annotations

import numpy as np

from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.behaviours.roles import blocks, in_the_way, running, towards
from esp_trainer.analysis.behaviours.thresholds import Thresholds
from esp_trainer.analysis.behaviours.windows import ago, ahead, cosine, cross, dot, extent, steps, total


def circling(paths: Paths, thresholds: Thresholds) -> np.ndarray:
    """Rows at which a prey has gone round in a small circle with a predator on its tail, bool
    ``(n_episodes, n_rows)``.

    "sometimes goes around in a small circle with the closest predator following on its tail" (VI.B). For some number of
    steps from 8 to ``circle``, the prey's turns to the left and to the right differ by at least 4 (once round), it ends
    at most 2 from where it began, and one predator was at most ``tail`` away all the time, three quarters of its steps
    towards the prey. Eight steps, as the smallest circle has four and once round in it may be chance.
    """
    moves = steps(paths.prey)
    turns = cross(ago(moves, 1), moves)
    close, on_it = paths.distances <= thresholds.tail, towards(paths)
    found = np.zeros(paths.alive.shape, bool)
    for length in range(8, thresholds.circle + 1, 4):
        round_once = np.abs(total(turns, length)) >= 4
        closed = np.abs(paths.prey - ago(paths.prey, length)).sum(axis=3) <= 2
        tailed = (total(close, length + 1) > length) & (4 * total(on_it, length) >= 3 * length)
        found |= round_once & closed & tailed.any(axis=2) & paths.reaches(back=length + 1)[:, :, None]
    return np.asarray((found & paths.alive).any(axis=2))


def baiting(paths: Paths, thresholds: Thresholds) -> np.ndarray:
    """Rows at which a prey leaves two predators that it let converge on it, bool ``(n_episodes, n_rows)``.

    "intelligent baiting behavior by waiting for the two predators to converge towards it before moving away in a
    direction opposite to that of the predators" (VI.B). A prey cannot stand still: it waits where it keeps to a box of
    side ``pause`` for ``wait`` steps. In that time two predators come nearer by ``approach`` each, to at most
    ``converged``, and are seen from different sides, at least 90 degrees apart. Over the next ``escape`` steps it gets
    at least 8 tenths as far as it can, towards neither of the two (at least 70 degrees off where they stood), and is
    free at the end.
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
    """Rows at which a prey that runs at a blocker is about to step aside and pass it, bool ``(n_episodes, n_rows)``.

    "the prey learns to avoid the blocker by sidestepping as it crosses the blocker's path" (VI.B). The prey has run
    ``run`` steps straight at a predator that blocks it (see :func:`.roles.blocks`), at most ``converged`` ahead and at
    most one cell to the side. Within ``escape`` steps the predator is behind it, because the prey passed it: by steps
    of its own in the direction in which it ran, and with a shift to the side. The prey is free then.
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
    """Rows at which a prey that runs between predators turns round and gains distance, bool ``(n_episodes, n_rows)``.

    "the prey learns to reverse its direction so that it avoids both the attackers and the blocker" (VI.B). The prey has
    run ``run`` steps, and within two more steps, which may go aside, begins to run as many in the opposite direction.
    As it turned one predator was ahead and another behind, both at most ``reach`` away. ``escape`` steps later it
    is free and the nearest predator is farther away than it was.
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
    """Rows from ``back`` rows before which to ``on`` after a prey is free, bool ``(n_episodes, n_rows, n_prey)``."""
    return np.asarray(ahead(paths.alive, on) & paths.reaches(back, on)[:, :, None])
