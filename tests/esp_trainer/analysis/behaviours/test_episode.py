"""What detectors ask of an episode at a row, by hand and against loops over the rows."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from esp_trainer.analysis.behaviours.detection import detected
from esp_trainer.analysis.behaviours.episode import (
    Episode,
    cosine,
    cross,
    episode_of,
    extent,
    in_the_way,
    is_free_around,
    led_towards,
    nearest_distance,
    running,
    turned,
    was_free,
)
from esp_trainer.analysis.behaviours.thresholds import Thresholds

PREDATOR, PREY = 0, 0  # the first of each


def episode(scene: Any) -> Episode:
    """The episode of a scene. (Compiled rules return no arrays.)"""
    return episode_of.py_func(detected(scene.paths(), Thresholds()).episodes, 0)


def where(rule: Any, one: Episode, *arguments: Any) -> list[int]:
    """The rows from 2 on, which look back to the start at most, at which a rule holds."""
    return [row for row in range(2, len(one.cells)) if rule(one, row, *arguments)]


def test_steps_towards_are_told_from_others(scene: Any):
    """The prey is at (50, 50), then (51, 50): the predator steps nearer, aside in its row, back, not at all."""
    one = episode(scene([((48, 50), "ENW.")], [((50, 50), "ENES")]))
    assert [led_towards(one, row, PREDATOR, PREY) for row in range(1, 5)] == [True, False, False, False]


def test_a_turn_is_a_step_unlike_the_one_before(scene: Any):
    assert where(turned, episode(scene([((48, 50), "EENN.EE")], [((50, 50), "N" * 7)])), PREDATOR) == [3, 5, 6]


def test_a_prey_runs_after_six_steps_the_same_way(scene: Any):
    one = episode(scene([], [((50, 50), "N" + "E" * 7 + "N")]))
    directions = [running(one, row, PREY, 6) for row in range(10)]
    assert directions == [(0, 0)] * 7 + [(1, 0), (1, 0), (0, 0)]


def test_who_is_in_the_way_is_ahead_in_the_lane(scene: Any):
    one = episode(scene([((60, 51), ""), ((60, 53), ""), ((49, 50), "")], [((50, 50), "E" * 6)]))
    assert [where(in_the_way, one, predator, PREY, 6, 10, 2) for predator in range(3)] == [[6], [], []]


def test_the_nearest_predator_is_as_far_as_its_steps(scene: Any):
    one = episode(scene([((60, 51), "W"), ((60, 53), ""), ((98, 50), "EE")], [((50, 50), "EE")]))
    assert [nearest_distance(one, row, PREY) for row in range(3)] == [11, 9, 8]


def test_windows_of_a_free_prey_end_with_its_capture(scene: Any):
    """It is caught in row 4 of an episode of eight steps."""
    one = episode(scene([((46, 50), "EEEE")], [((50, 50), "EWEW"), ((20, 20), "N" * 8)]))
    assert one.capture_times[PREY] == 4
    assert where(is_free_around, one, PREY, 2, 1) == [2]
    assert where(was_free, one, PREY, 3) == [3, 4]


@given(st.integers(0, 10_000), st.integers(0, 12))
def test_an_extent_is_the_longer_side_of_the_box(seed: int, rows: int):
    cells = np.random.default_rng(seed).integers(-5, 6, (15, 2, 2))
    none = np.zeros((15, 1, 1), bool)
    one = Episode(cells, np.zeros((15, 2, 1, 2), int), np.array([15]), 14, 1, 1, none, none)
    for row in range(rows, 15):
        assert extent(one, row, PREDATOR, rows) == np.ptp(cells[row - rows : row + 1, PREDATOR], axis=0).max()


def test_left_is_positive():
    east, north = (1, 0), (0, 1)
    assert cross(east, north) == 1
    assert cross(north, east) == -1


def test_cosines_by_hand():
    found = [cosine((2, 0), other) for other in ((3, 3), (0, 1), (-4, 0), (0, 0))]
    assert found == pytest.approx([np.sqrt(0.5), 0, -1, 1])


def test_cosines_on_a_large_torus():
    """The product of two squares does not fit into 32 bits."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert cosine((4000, 0), (-4000, 0)) == -1
        assert cosine.py_func((4000, 0), (-4000, 0)) == -1
