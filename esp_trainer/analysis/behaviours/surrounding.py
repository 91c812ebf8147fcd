"""Detector of predators that surround a prey."""

from __future__ import annotations

import numpy as np

from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.behaviours.thresholds import Thresholds
from esp_trainer.analysis.behaviours.windows import ago


def encirclement(paths: Paths, thresholds: Thresholds) -> np.ndarray:
    """Detect a free prey that is surrounded: rows, bool ``(n_episodes, n_rows)``.

    "they need to surround the prey from different sides so that they do not have anywhere to escape before they can
    catch them" (III). All of these hold:

    * Three or more predators are at most ``near``.
    * Seen from the prey, every gap between these predators is narrower than 180 degrees. So the prey is inside their
      convex hull, as in most definitions of target enclosing.
    * Over ``wait`` steps, these predators came nearer by ``approach`` on average.
    """
    near = paths.distances <= thresholds.near
    closer = np.where(near, ago(paths.distances, thresholds.wait) - paths.distances, 0).sum(axis=2)
    n_near = near.sum(axis=2)
    found = (
        (n_near >= 3)
        & (closer >= thresholds.approach * n_near)
        & paths.alive
        & paths.reaches(back=thresholds.wait)[:, :, None]
    )
    found[found] = _widest_gap(paths.offsets.swapaxes(2, 3)[found], near.swapaxes(2, 3)[found]) < np.pi - 1e-9
    return np.asarray(found.any(axis=2))


def _widest_gap(offsets: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Return the widest angle without a near predator, in radians, float ``(n,)``, for offsets
    ``(n, n_predators, 2)``.
    """
    angles = np.arctan2(offsets[..., 1], offsets[..., 0])
    some = np.take_along_axis(angles, near.argmax(axis=1)[:, None], axis=1)
    angles = np.sort(np.where(near, angles, some), axis=1)
    return np.asarray(np.diff(angles, axis=1, append=angles[:, :1] + 2 * np.pi).max(axis=1))
