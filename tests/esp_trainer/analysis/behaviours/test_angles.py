"""Angles at the very bound of a definition."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from esp_trainer.analysis.behaviours.detection import detected
from esp_trainer.analysis.behaviours.episode import episode_of
from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.behaviours.roles import opposing_attack
from esp_trainer.analysis.behaviours.surrounding import encirclement
from esp_trainer.analysis.behaviours.thresholds import Thresholds

T = Thresholds()
AT_ONCE = Thresholds(wait=0, approach=0)


def opposed(one: tuple[int, int], other: tuple[int, int], scene: Any) -> bool:
    """Whether two attackers are seen to oppose each other that keep to these offsets from the prey."""
    predators = [((50 + x, 50 + y), "NS" * 8) for x, y in (one, other)]
    episode = episode_of.py_func(detected(scene(predators, [((50, 50), "NS" * 8)]).paths(), T).episodes, 0)
    attackers = episode._replace(attacks=np.ones_like(episode.attacks))
    found = {bool(opposing_attack(attackers, row, T)) for row in range(len(episode.cells))}
    assert len(found) == 1
    return found.pop()


@pytest.mark.parametrize("k", range(2, 6))
def test_who_is_less_than_135_degrees_apart_does_not_oppose(k: int, scene: Any):
    assert not opposed((k, 0), (1 - k, k), scene)
    assert opposed((k, 0), (-k, k - 1), scene)


def test_who_is_135_degrees_apart_opposes_at_any_distance(scene: Any):
    """Where rounding might decide: the cosine is an irrational number."""
    assert [opposed((k, 0), (-k, k), scene) for k in range(1, 6)] == [True] * 5


@pytest.mark.parametrize(
    ("offsets", "surrounded"),
    [
        ([(3, 0), (-3, 1), (-3, -1)], True),
        ([(3, 0), (-3, 0), (0, 3)], False),  # in the south a gap of exactly 180 degrees
        ([(3, 0), (-3, 0), (0, 3), (0, -3)], True),
        ([(3, 1), (3, 2), (-2, -1)], True),  # the widest gap has 173 degrees
        ([(3, 1), (6, 2), (-3, -1)], False),  # two in one direction, and one opposite
        ([(1, 1), (1, 2), (2, 1)], False),
    ],
)
def test_who_is_surrounded_has_no_free_half_plane(offsets: list[tuple[int, int]], surrounded: bool, scene: Any):
    predators = [((50 + x, 50 + y), "") for x, y in offsets]
    paths = Paths.of_trace(scene(predators, [((50, 50), "N")]).trace(), len(offsets), 100)
    assert bool(encirclement(episode_of.py_func(detected(paths, AT_ONCE).episodes, 0), 0, AT_ONCE)) == surrounded
