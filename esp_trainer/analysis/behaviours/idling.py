"""Detectors of idling. Only predators can idle."""

from __future__ import annotations

import numpy as np

from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.behaviours.thresholds import Thresholds
from esp_trainer.arrays import BoolMask, Fractions


def idling(paths: Paths, _: Thresholds) -> Fractions:
    """Return the fraction of the predators' steps that are idle, float ``(n_episodes,)``.

    "To evolve blocking strategies in predators, the idle action is often important" (V).
    """
    return _idle(paths).sum(axis=(1, 2)) / np.maximum(paths.lengths * paths.n_predators, 1)


def parity_idle(paths: Paths, _: Thresholds) -> Fractions:
    """Return the fraction of captures by a predator that had idled an odd number of times, float ``(n_episodes,)``.

    It is nan where no captor is known. Captors are the predators in the prey's cell when it is caught; if there are
    several, one that had idled an odd number of times suffices.

    Idling made these captures possible: on a torus of even size, where all agents move at once and prey always move, a
    predator at an odd distance from a prey can land on it only after it has idled an odd number of times.
    """
    odd = np.cumsum(_idle(paths), axis=1) % 2 == 1
    episode, prey = np.nonzero(paths.capture_times <= paths.lengths[:, None])
    row = paths.capture_times[episode, prey]
    captor = paths.distances[episode, row, :, prey] == 0
    known = captor.any(axis=1)
    counts = np.bincount(episode[known], minlength=paths.n_episodes)
    mended = np.bincount(episode[(captor & odd[episode, row]).any(axis=1)], minlength=paths.n_episodes)
    return np.where(counts > 0, mended / np.maximum(counts, 1), np.nan)


def _idle(paths: Paths) -> BoolMask:
    idle = np.zeros(paths.predators.shape[:3], bool)
    idle[:, 1:] = (np.diff(paths.predators, axis=1) == 0).all(axis=3) & paths.valid[:, 1:, None]
    return idle
