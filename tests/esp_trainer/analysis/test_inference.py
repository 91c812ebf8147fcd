"""Intervals and tests over seeds against tables and worked examples."""

from __future__ import annotations

from collections.abc import Callable
from math import inf, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import t

from esp_trainer.analysis.inference import Comparison, against, compare, holm, over_seeds, student_95

samples = st.lists(st.integers(-20, 20).map(float), min_size=2, max_size=12)


def test_a_mean_has_students_interval():
    # t of 4 degrees of freedom at 0.975 is 2.776 in any table; the standard error of 1 to 5 is sqrt(2.5 / 5).
    estimate = over_seeds([1, 2, 3, 4, 5])
    assert (estimate.mean, estimate.n) == (3, 5)
    assert estimate.high - 3 == pytest.approx(2.776 * sqrt(0.5), rel=2e-4)
    assert 3 - estimate.low == pytest.approx(2.776 * sqrt(0.5), rel=2e-4)
    assert str(estimate) == "3.000 [1.037, 4.963]"


def test_students_quantile_is_that_of_scipy():
    assert student_95(1) == pytest.approx(12.706, rel=1e-4)
    assert student_95(30) == pytest.approx(2.042, rel=2e-4)
    for degrees in (*range(1, 60), 999, 1000):
        assert student_95(degrees) == pytest.approx(t.ppf(0.975, degrees), rel=1e-12)


def test_equal_seeds_have_no_width():
    assert str(over_seeds([0.3] * 10)) == "0.300 [0.300, 0.300]"


def test_intervals_of_ten_seeds_hold_the_mean_95_times_in_100():
    drawn = np.random.default_rng(0).normal(size=(2000, 10))
    held = [e.low <= 0 <= e.high for e in map(over_seeds, drawn)]
    assert np.mean(held) == pytest.approx(0.95, abs=0.015)


def test_groups_are_compared_by_hand():
    # Differences 2, 3, 4, 1, 2, 3, 0.5, 1.5, 2.5 (a less b): all above 0, so U = 9 and p is 2 of 20 orders, 0.1: three
    # against three can't reach 0.05, so no interval of 95% ends.
    found = compare([5, 4, 3.5], [3, 2, 1])
    assert found.difference == 2
    assert found.effect == 1
    assert found.p == pytest.approx(0.1)
    assert (found.low, found.high) == (-inf, inf)


def test_ties_are_tested_with_their_variance():
    # U = 2.5 of 16, 5.5 below its mean, with variance 16 / 12 * (9 - (24 + 6 + 6) / 56) = 11.143: with the correction
    # for continuity z = 5 / 3.338 = 1.498, and p = 0.134 in any table.
    assert compare([1, 2, 2, 3], [2, 3, 4, 4]).p == pytest.approx(0.1342, abs=1e-4)


def test_the_interval_of_four_against_four_is_the_whole_range():
    # The critical value of U for four and four at 0.05 is 0 in any table.
    found = compare([5, 6, 7, 8], [1, 2, 3, 3.5])
    assert (found.low, found.high) == (1.5, 7)


def test_the_interval_of_ten_against_ten_leaves_23_pairs_out_on_each_side():
    # The critical value of U for ten and ten at 0.05 is 23 in any table.
    a, b = np.arange(10.0), 0.01 * np.arange(10)
    differences = np.sort((a[:, None] - b).ravel())
    found = compare(a, b)
    assert (found.low, found.high) == (differences[23], differences[-24])


def test_cliffs_delta_counts_pairs():
    # Of six pairs two above, one tie, three below.
    assert compare([1, 3], [0, 3, 4]).effect == pytest.approx((2 - 3) / 6)


@given(samples, samples)
def test_exchanging_the_groups_turns_the_comparison_round(a: list[float], b: list[float]):
    one, other = compare(a, b), compare(b, a)
    turned = Comparison(-one.difference, -one.high, -one.low, -one.effect, one.p)
    assert vars(other) == pytest.approx(vars(turned))
    assert one.low <= one.difference <= one.high
    assert 0 <= one.p <= 1


def test_the_interval_and_the_test_agree():
    random = np.random.default_rng(0)
    for _ in range(100):
        found = compare(random.normal(size=10), random.normal(size=10) + 0.9)
        assert (found.p <= 0.05) == (found.low > 0 or found.high < 0)


def test_equal_groups_do_not_differ():
    found = compare([0.5] * 5, [0.5] * 6)
    assert (found.difference, found.effect, found.p) == (0, 0, 1)


def test_ten_seeds_above_the_null_are_one_of_512():
    found = against(np.arange(1.0, 11), null=0.5)
    assert found.p == pytest.approx(2 / 1024)
    assert found.difference == pytest.approx(5)
    assert found.effect == 1
    assert found.low > 0


def test_signs_are_flipped_in_all_ways():
    # Sums of +-1 +-2 +-3 as far from 0 as 1 + 2 - ... + 3: of eight, 6 and 4 above, and below: (1, -2, 3) sums to 2.
    assert against([1, 2, 3]).p == pytest.approx(2 / 8)
    assert against([-1, 2, 3]).p == pytest.approx(4 / 8)
    assert against([1, -2, 3]).p == pytest.approx(6 / 8)


def test_more_seeds_than_can_be_flipped_in_all_ways_give_the_same_p_each_time():
    values = np.random.default_rng(0).normal(size=30) + 0.4
    assert against(values) == against(values)
    assert against(values + 5).p < 0.001


@given(samples)
def test_the_side_does_not_matter_against_a_null(values: list[float]):
    one, other = against(values), against([-v for v in values])
    assert one.p == pytest.approx(other.p)
    assert (one.difference, one.effect) == (-other.difference, -other.effect)


def test_values_at_the_null_say_nothing():
    found = against([0.2, 0.2, 0.2], null=0.2)
    assert (found.difference, found.effect, found.p) == (0, 0, 1)


def test_a_comparison_reads_as_a_row_of_a_table():
    assert str(Comparison(0.1234, -0.05, 0.3, 0.456, 0.0321)) == "+0.123 [-0.050, +0.300], delta +0.46, p 0.032"


def test_holms_procedure_by_hand():
    # Smallest first: 4 * 0.005, 3 * 0.01, 2 * 0.03, and 0.04 no lower than the one before it.
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.7, 0.6]) == pytest.approx([1, 1])
    assert holm([]).shape == (0,)


@given(st.lists(st.floats(0, 1), min_size=1, max_size=8))
def test_holm_lies_between_no_correction_and_bonferronis(p_values: list[float]):
    p, adjusted = np.array(p_values), holm(p_values)
    assert (p <= adjusted).all()
    assert (adjusted <= np.minimum(1, p * len(p))).all()
    assert adjusted.min() == min(1, p.min() * len(p))
    assert (np.diff(adjusted[np.argsort(p)]) >= 0).all()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: over_seeds([1]), r"values must hold .* at least two seeds, got \[1\]"),
        (lambda: compare([1, 2], [np.nan, 1]), "b must hold a finite number"),
        (lambda: against(np.zeros((2, 2))), "values must hold"),
        (lambda: holm([0.5, 1.5]), r"p_values must be numbers in \[0, 1\], \(n,\), got \[0.5, 1.5\]"),
    ],
)
def test_bad_input_is_refused(call: Callable[[], object], message: str):
    with pytest.raises(ValueError, match=message):
        call()
