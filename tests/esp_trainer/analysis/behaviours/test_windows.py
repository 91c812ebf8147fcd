"""Windows against loops over the rows."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from esp_trainer.analysis.behaviours.windows import cosine, cross, extent, spread_back, steps, total

SEEDS, ROWS = st.integers(0, 10_000), st.integers(0, 12)


@given(SEEDS, ROWS)
def test_a_total_is_over_a_row_and_those_before(seed: int, rows: int):
    values = np.random.default_rng(seed).integers(-1, 2, (2, 15, 3))
    expected = [values[:, max(0, row - rows + 1) : row + 1].sum(axis=1) for row in range(15)]
    assert np.array_equal(total(values, rows), np.stack(expected, axis=1))


def test_a_total_longer_than_the_array_is_of_all_so_far():
    assert total(np.array([[True, False, True]]), 7).tolist() == [[1, 1, 2]]


@given(SEEDS, ROWS)
def test_an_extent_is_the_longer_side_of_the_box(seed: int, rows: int):
    cells = np.random.default_rng(seed).integers(-5, 6, (2, 15, 2))
    for row in range(rows, 15):
        window = cells[:, row - rows : row + 1]
        assert np.array_equal(extent(cells, rows)[:, row], np.ptp(window, axis=1).max(axis=-1))


@given(SEEDS, st.integers(0, 20))
def test_marks_spread_back_so_many_rows(seed: int, rows: int):
    found = np.random.default_rng(seed).random((2, 15)) < 0.15
    expected = [found[:, row : row + rows + 1].any(axis=1) for row in range(15)]
    assert np.array_equal(spread_back(found, rows), np.stack(expected, axis=1))


def test_no_step_leads_to_the_start():
    assert steps(np.array([[[3, 4], [4, 4], [4, 3]]])).tolist() == [[[0, 0], [1, 0], [0, -1]]]


def test_left_is_positive():
    east, north = np.array([1, 0]), np.array([0, 1])
    assert cross(east, north) == 1
    assert cross(north, east) == -1


def test_cosines_by_hand():
    east, other = np.array([2, 0]), np.array([[3, 3], [0, 1], [-4, 0], [0, 0]])
    assert np.allclose(cosine(east, other), [np.sqrt(0.5), 0, -1, 1])
