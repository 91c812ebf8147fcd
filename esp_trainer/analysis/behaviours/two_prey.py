"""What happens to two prey together (section VI.C)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.behaviours.thresholds import Thresholds
from esp_trainer.analysis.behaviours.windows import ago, ahead, cosine, dot, total


def herding(paths: Paths, thresholds: Thresholds) -> np.ndarray:
    """Rows at which two prey have been driven together, bool ``(n_episodes, n_rows)``.

    The predators "first attempt to herd the prey" and "succeed in herding the prey and capturing them simultaneously"
    (VI.C). Over ``herd`` steps two free prey came nearer to each other by ``gathered`` or more, to at most ``reach``,
    and for a share ``driven`` of them each was driven: its nearest predator was at most ``reach`` away, on the
    side away from the other prey, as a shepherd is (Strombom et al., Solving the shepherding problem, 2014).
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
    """Whether two prey are caught within ``together`` steps, float ``(n_episodes,)``.

    "capturing them simultaneously" (VI.C).
    """
    times = np.sort(paths.capture_times, axis=1)
    close = (np.diff(times, axis=1) <= thresholds.together) & (times[:, 1:] < paths.n_rows)
    return np.asarray(close.any(axis=1), float)


def scattering(paths: Paths, thresholds: Thresholds) -> np.ndarray:
    """Rows at which two prey part before predators that converge on them, bool ``(n_episodes, n_rows)``.

    "the prey evolve to scatter in different directions just before the predators converge on them" (VI.C). Two free
    prey are at most ``near`` apart; two or more predators came nearer to the nearer of them by ``approach`` over
    ``wait`` steps, to at most ``near``. ``escape`` steps later both are free, as much farther apart as one alone could
    have run, and the ways that they went are at least 90 degrees apart, each half as long as it can be or longer. Nor
    did they just cross: one of them at least did not go on as before, but turned by 90 degrees or more from where it
    went in the ``wait`` steps.
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
    """Each pair of prey: the two, the way from one to the other, and its length."""
    for one in range(paths.n_prey):
        for other in range(one):
            way = paths.between_prey(one, other)
            yield one, other, way, np.abs(way).sum(axis=2)


def _driven(paths: Paths, prey: int, inwards: np.ndarray, reach: int) -> np.ndarray:
    distances, offsets = paths.distances[..., prey], paths.offsets[..., prey, :]
    outside = dot(offsets, inwards[:, :, None]) < 0
    nearest = distances == distances.min(axis=2, keepdims=True)
    return np.asarray((nearest & outside & (distances <= reach)).any(axis=2))
