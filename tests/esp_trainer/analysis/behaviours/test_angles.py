"""Angles at the very bound of a definition, and on a large torus."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest

from esp_trainer.analysis.behaviours import roles
from esp_trainer.analysis.behaviours.thresholds import Thresholds
from esp_trainer.analysis.behaviours.windows import cosine


def opposed(one: tuple[int, int], other: tuple[int, int], scene: Any, monkeypatch: pytest.MonkeyPatch) -> bool:
    """Whether two attackers are seen to oppose each other that keep to these offsets from the prey."""
    predators = [((50 + x, 50 + y), "NS" * 8) for x, y in (one, other)]
    paths = scene(predators, [((50, 50), "NS" * 8)]).paths()
    monkeypatch.setattr(roles, "attacks", lambda paths, thresholds: np.ones(paths.distances.shape, bool))
    found = roles.opposing_attack(paths, Thresholds())
    assert found.all() == found.any()
    return bool(found.any())


@pytest.mark.parametrize("k", range(2, 6))
def test_who_is_less_than_135_degrees_apart_does_not_oppose(k: int, scene: Any, monkeypatch: pytest.MonkeyPatch):
    assert not opposed((k, 0), (1 - k, k), scene, monkeypatch)
    assert opposed((k, 0), (-k, k - 1), scene, monkeypatch)


def test_who_is_135_degrees_apart_opposes_at_any_distance(scene: Any, monkeypatch: pytest.MonkeyPatch):
    """Where rounding might decide: the cosine is an irrational number."""
    assert [opposed((k, 0), (-k, k), scene, monkeypatch) for k in range(1, 6)] == [True] * 5


def test_cosines_on_a_large_torus():
    """The product of two squares does not fit into the 32 bits of cells."""
    one, other = np.array([[4000, 0]], np.int32), np.array([[-4000, 0]], np.int32)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert cosine(one, other) == pytest.approx(-1)
