"""Traces made continuous, and who was caught when."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from esp_trainer.analysis.behaviours.paths import Paths

FAR = ((80, 80), "")


def test_a_walk_over_the_seam_goes_on(scene: Any):
    paths = scene([((98, 1), "EEE.SSS")], [((50, 50), "NSNSNSN")]).paths()
    assert paths.predators[0, :, 0].tolist() == [
        [98, 1], [99, 1], [100, 1], [101, 1], [101, 1], [101, 0], [101, -1], [101, -2],
    ]  # fmt: skip


def test_offsets_and_distances_are_those_of_the_shortest_way(scene: Any):
    paths = scene([((98, 1), "E")], [((2, 97), "W")]).paths()
    assert paths.offsets[0, :, 0, 0].tolist() == [[-4, 4], [-2, 4]]
    assert paths.distances[0, :, 0, 0].tolist() == [8, 6]


@given(st.integers(3, 12), st.integers(0, 100))
def test_distances_are_those_of_wrapped_cells(size: int, seed: int):
    generator = np.random.default_rng(seed)
    steps = np.array([(1, 0), (-1, 0), (0, 1), (0, -1)])[generator.integers(0, 4, (3, 30, 4))]
    trace = (generator.integers(0, size, (3, 1, 4, 2)) + np.cumsum(steps, axis=1)) % size
    apart = np.abs(trace[:, :, :3, None] - trace[:, :, None, 3:])
    expected = np.minimum(apart, size - apart).sum(axis=-1)
    assert np.array_equal(Paths.of_trace(trace, 3, size).distances, expected)


def test_two_prey_see_each_other_the_shortest_way(scene: Any):
    paths = scene([], [((98, 50), "E"), ((3, 49), "N")]).paths()
    assert paths.all_offsets[0, :, paths.n_predators + 1, 0].tolist() == [[5, -1], [4, 0]]


def test_a_prey_that_stands_still_was_caught_when_it_got_there(scene: Any):
    paths = scene([((45, 50), "EE..E")], [((49, 50), "WW..."), ((20, 20), "NNNNN")]).paths()
    assert paths.capture_times.tolist() == [[2, 6]]
    assert paths.captured.tolist() == [[True, False]]


@pytest.mark.parametrize(("moves", "time"), [("EEE", 3), ("EE.", 4)])
def test_in_the_last_row_a_predator_in_its_cell_tells(moves: str, time: int, scene: Any):
    assert scene([((44, 50), moves)], [((50, 50), "WWW")]).paths().capture_times.tolist() == [[time]]


def test_a_recorded_capture_tells_more_than_the_predators_cell(scene: Any):
    """In turns a prey can run into a predator that then moves on."""
    trace = scene([((46, 50), "..N")], [((49, 50), "WWW")]).trace()
    assert Paths.of_trace(trace, 3, 100).capture_times.tolist() == [[4]]
    assert Paths.of_trace(trace, 3, 100, np.array([[3]])).capture_times.tolist() == [[3]]


def test_an_episode_that_ends_early_ended_as_all_were_caught(scene: Any):
    paths = scene([((46, 50), "..N")], [((49, 50), "WWW"), ((20, 20), "N..")], n_rows=10).paths()
    assert paths.lengths.tolist() == [3]
    assert paths.capture_times.tolist() == [[3, 1]]
    assert paths.valid[0].tolist() == [True] * 4 + [False] * 6


def test_rows_after_the_end_repeat_the_last(scene: Any):
    paths = scene([((48, 50), "E")], [((50, 50), "W")], n_rows=4).paths()
    assert paths.predators[0, :, 0].tolist() == [[48, 50], [49, 50], [49, 50], [49, 50]]


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda trace: trace[0], "cells must have shape"),
        (lambda trace: trace[:, :, :3], "cells must have shape"),
        (lambda trace: trace + 100, "must hold cells in"),
        (lambda trace: np.where(np.arange(5)[:, None, None] == 2, -1, trace), "must hold cells in"),
        (lambda trace: np.full_like(trace, -1), "must hold cells in"),
        (lambda trace: trace * 3 % 100, "at most one cell a step, got 3"),
    ],
)
def test_what_is_no_trace_is_refused(spoil: Callable[[np.ndarray], np.ndarray], message: str, scene: Any):
    with pytest.raises(ValueError, match=message):
        Paths.of_trace(spoil(scene([FAR], [((50, 50), "NNNN")]).trace()), 3, 100)


def test_captures_of_another_shape_are_refused(scene: Any):
    with pytest.raises(ValueError, match=r"caught_at must have shape \(1, 1\), got \(1, 2\)"):
        Paths.of_trace(scene([], [((50, 50), "N")]).trace(), 3, 100, np.zeros((1, 2), int))
