"""Intervals over runs and opponents, and the test of the lesser gain, by hand."""

from __future__ import annotations

from dataclasses import astuple

import numpy as np
import pytest

from esp_trainer.analysis.gains import Interval, by_third, gained, lesser_gain, over_runs_and_panel
from esp_trainer.analysis.late_panel import late_gain


def test_an_interval_is_as_wide_as_runs_and_opponents_differ() -> None:
    assert astuple(over_runs_and_panel(np.full((4, 3), 0.4))) == pytest.approx((0.4, 0.4, 0.4))
    by_rows = np.repeat([[0.0], [1.0]], 5, axis=1)
    assert over_runs_and_panel(by_rows) == over_runs_and_panel(by_rows.T) == Interval(0.5, 0.0, 1.0)
    generator = np.random.default_rng(1)
    rows, columns = generator.normal(0.5, 0.1, (40, 1)), generator.normal(0.0, 0.1, (1, 40))
    found = over_runs_and_panel(rows + columns)
    assert found.mean == pytest.approx(0.5, abs=0.05)
    assert found.high - found.low == pytest.approx(2 * 1.96 * np.sqrt(0.01 / 40 + 0.01 / 40), rel=0.25)


def test_an_interval_is_told_with_signs() -> None:
    assert str(Interval(0.25, -0.0625, 0.5)) == "+0.250 [-0.062, +0.500]"


def test_an_interval_counts_runs_and_panel_as_samples() -> None:
    """With one value for each member of the panel, all of the spread is the panel's: sd / sqrt(n) to each side."""
    members = np.random.default_rng(0).normal(0, 1, 50)
    table = np.repeat(np.tile(members, (8, 1)), 3, axis=1)
    found = over_runs_and_panel(table, per_run=3)
    assert found.mean == pytest.approx(members.mean())
    half = 1.96 * members.std() / np.sqrt(50)
    assert found.high - found.mean == pytest.approx(half, rel=0.1)
    assert found.mean - found.low == pytest.approx(half, rel=0.1)
    turned = over_runs_and_panel(np.tile(members[:, None], (1, 6)), per_run=3)
    assert turned.high - turned.mean == pytest.approx(half, rel=0.1)


def test_the_lesser_gain_is_tested_against_runs_read_backwards() -> None:
    found, p = lesser_gain(np.full(10, 0.3), np.full(10, 0.1))
    assert found == pytest.approx(0.1)
    assert p == pytest.approx(2**-10, abs=0.001), "only if no run is turned"
    noise = np.random.default_rng(1).normal(0, 1, (2, 400))
    found, p = lesser_gain(*noise)
    assert found < -0.4, "below 0 where nothing changes"
    assert p > 0.05


def test_one_side_that_gains_what_the_other_loses_is_no_race() -> None:
    assert lesser_gain(np.full(10, 0.3), np.full(10, -0.3))[1] == 1.0


def test_a_run_gains_against_the_late_champions_of_the_others_alone() -> None:
    """Two runs of six generations gain 0.6 and 0.2 against each other, and 0.2 and 0.4 in their second halves."""
    own = np.full(6, np.nan)
    first, second = [0.1, 0.3, 0.4, 0.5, 0.6, 0.7], [0.3, 0.2, 0.0, 0.1, 0.3, 0.5]
    found = np.array([np.stack([own, first], axis=1), np.stack([second, own], axis=1)])
    assert late_gain(found, half=False).mean == pytest.approx(0.4)
    assert late_gain(found, half=True).mean == pytest.approx(0.3)
    same = np.stack([np.where(np.eye(5)[i], np.nan, np.linspace(0, 1, 6)[:, None]) for i in range(5)])
    alike = late_gain(same, half=False)
    assert (alike.low, alike.mean, alike.high) == pytest.approx((1, 1, 1)), "runs that are alike leave no doubt"


def test_sixths_and_thirds_are_means_of_equal_parts() -> None:
    twelve = np.arange(12.0)[None]
    assert gained(twelve, half=False).tolist() == [10.0]  # 10.5 less 0.5
    assert gained(twelve, half=True).tolist() == [5.0]  # 11 less 6
    assert by_third(twelve).tolist() == [[1.5, 5.5, 9.5]]
