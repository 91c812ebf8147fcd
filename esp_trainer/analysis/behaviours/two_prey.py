"""Detectors of behaviours that involve two prey (section VI.C)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.behaviours.thresholds import Thresholds
from esp_trainer.analysis.behaviours.windows import ago, ahead, cosine, dot, total


def herding(paths: Paths, thresholds: Thresholds) -> np.ndarray:
    """Detect two prey that have been driven together: rows, bool ``(n_episodes, n_rows)``.

    The predators "first attempt to herd the prey" and "succeed in herding the prey and capturing them simultaneously"
    (VI.C). All of these hold over ``herd`` steps:

    * Two free prey came nearer to each other by ``gathered`` or more, to at most ``reach``.
    * In a fraction ``driven`` of the steps or more, both prey were driven: the nearest predator of each was at most
      ``reach`` away, on the side away from the other prey, as a shepherd is (Strombom et al., Solving the shepherding
      problem, 2014).
    """
    found = np.zeros(paths.valid.shape, bool)
    for one, other, way, apart in _pairs(paths):
        gathered = ago(apart, thresholds.herd) - apart >= thresholds.gathered
        driven = _driven(paths, one, way, thresholds.reach) & _driven(paths, other, -way, thresholds.reach)
        kept_up = total(driven, thresholds.herd) >= thresholds.driven * thresholds.herd
        free = paths.alive[:, :, one] & paths.alive[:, :, other] & paths.reaches(back=thresholds.herd)
        found |= gathered & (apart <= thresholds.reach) & kept_up & free
    return found


def simultaneous_capture(paths: Paths, thresholds: Thresholds) -> np.ndarray:
    """Detect two prey that are caught within ``together`` steps: 1 or 0 per episode, float ``(n_episodes,)``.

    "capturing them simultaneously" (VI.C).
    """
    times = np.sort(paths.capture_times, axis=1)
    close = (np.diff(times, axis=1) <= thresholds.together) & (times[:, 1:] < paths.n_rows)
    return np.asarray(close.any(axis=1), float)


def scattering(paths: Paths, thresholds: Thresholds) -> np.ndarray:
    """Detect two prey that separate before predators that converge on them: rows, bool ``(n_episodes, n_rows)``.

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
    on = thresholds.escape
    found = np.zeros(paths.valid.shape, bool)
    for one, other, _, apart in _pairs(paths):
        to_pair = np.minimum(paths.distances[..., one], paths.distances[..., other])
        nearer = ago(to_pair, thresholds.wait) - to_pair
        converging = ((nearer >= thresholds.approach) & (to_pair <= thresholds.near)).sum(axis=2) >= 2
        cells = paths.prey[:, :, [one, other]]
        before, after = cells - ago(cells, thresholds.wait), ahead(cells, on) - cells
        part = (ahead(apart, on) - apart >= on) & (cosine(after[:, :, 0], after[:, :, 1]) <= 0)
        part &= (dot(before, after) <= 0).any(axis=2) & (2 * np.abs(after).sum(axis=3) >= on).all(axis=2)
        free = ahead(paths.alive[:, :, one] & paths.alive[:, :, other], on) & paths.reaches(thresholds.wait, on)
        found |= (apart <= thresholds.near) & converging & part & free
    return found


def _pairs(paths: Paths) -> Iterator[tuple[int, int, np.ndarray, np.ndarray]]:
    """Yield for each pair of prey both indices, the displacement from one to the other, and its length."""
    for one in range(paths.n_prey):
        for other in range(one):
            way = paths.between_prey(one, other)
            yield one, other, way, np.abs(way).sum(axis=2)


def _driven(paths: Paths, prey: int, inwards: np.ndarray, reach: int) -> np.ndarray:
    distances, offsets = paths.distances[..., prey], paths.offsets[..., prey, :]
    outside = dot(offsets, inwards[:, :, None]) < 0
    nearest = distances == distances.min(axis=2, keepdims=True)
    return np.asarray((nearest & outside & (distances <= reach)).any(axis=2))
