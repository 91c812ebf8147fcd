"""Phases of hand-made curves, and few false alarms on noise."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter

from esp_trainer.analysis.phases import Phase, alternation, phases

STEPS = np.repeat([0.2, 0.6, 0.2, 0.6], [30, 45, 20, 55])


def wandering(correlation: float, n: int, seed: int) -> np.ndarray:
    """AR(1) noise, long after its start."""
    return lfilter([1.0], [1.0, -correlation], np.random.default_rng(seed).normal(size=n + 300))[300:]


def test_steps_are_dated_to_the_generation():
    found = phases(STEPS)
    assert [(phase.start, phase.end) for phase in found] == [(0, 30), (30, 75), (75, 95), (95, 150)]
    assert [phase.mean for phase in found] == pytest.approx([0.2, 0.6, 0.2, 0.6])


@pytest.mark.parametrize("correlation", [0.0, 0.3])
def test_steps_in_noise_are_dated_nearly(correlation: float):
    found = phases(STEPS + 0.05 * wandering(correlation, len(STEPS), seed=0))
    assert [phase.end for phase in found] == pytest.approx([30, 75, 95, 150], abs=2)


@pytest.mark.parametrize(
    ("n", "correlation", "most"),
    # The rates in the docstring, and three standard errors of 100 curves.
    [(75, 0.0, 0.05), (75, 0.6, 0.32), (75, 0.9, 0.49), (450, 0.0, 0.04), (450, 0.6, 0.12), (450, 0.9, 0.27)],
)
def test_noise_has_few_phases(correlation: float, most: float, n: int):
    false_alarms = [len(phases(wandering(correlation, n, seed))) > 1 for seed in range(100)]
    assert np.mean(false_alarms) <= most


@given(st.floats(-100, 100), st.floats(0.01, 100), st.integers(0, 20))
def test_phases_do_not_depend_on_the_unit(origin: float, scale: float, seed: int):
    curve = STEPS + 0.1 * wandering(0.3, len(STEPS), seed)
    assert [p.end for p in phases(origin + scale * curve)] == [p.end for p in phases(curve)]


def test_phases_cover_the_curve_and_have_its_means():
    curve = STEPS + 0.1 * wandering(0.0, len(STEPS), seed=3)
    found = phases(curve)
    assert found[0].start == 0
    assert found[-1].end == len(curve)
    for before, after in pairwise(found):
        assert before.end == after.start
    for phase in found:
        assert phase.mean == pytest.approx(curve[phase.start : phase.end].mean())


def test_a_phase_has_the_least_length():
    short = np.repeat([0.2, 0.9, 0.2], [40, 6, 40]) + 0.01 * wandering(0.0, 86, seed=0)
    assert [phase.end for phase in phases(short, min_length=5)] == [40, 46, 86]
    assert all(phase.end - phase.start >= 10 for phase in phases(short))


@pytest.mark.parametrize("curve", [np.full(50, 0.3), np.array([0.1, 0.9, 0.1]), np.repeat([0.0, 1.0], 9)])
def test_a_constant_or_short_curve_is_one_phase(curve: np.ndarray):
    assert phases(curve) == [Phase(0, len(curve), pytest.approx(curve.mean()))]


def test_a_curve_that_mostly_stands_still_has_phases_too():
    curve = np.zeros(120)
    curve[50:90] = 0.5
    assert [phase.end for phase in phases(curve)] == [50, 90, 120]


def test_alternations_are_counted_between_sides_of_the_mean():
    assert alternation(STEPS, np.random.default_rng(0), n_surrogates=1).count == 3
    # Up in three steps and down: over the mean once, and back.
    stairs = np.repeat([0.0, 0.1, 0.8, 0.9, 0.0], 30)
    assert len(phases(stairs)) == 5
    assert alternation(stairs, np.random.default_rng(0), n_surrogates=1).count == 2


def test_cycles_are_told_from_wandering():
    square = np.tile(np.repeat([0.2, 0.6], 30), 4) + 0.1 * wandering(0.0, 240, seed=0)
    found = alternation(square, np.random.default_rng(0), n_surrogates=99)
    assert found.count == 7
    assert found.p <= 0.03
    assert found == alternation(square, np.random.default_rng(0), n_surrogates=99)


@pytest.mark.parametrize("curve", [wandering(0.0, 150, seed=0), np.full(50, 0.5)])
def test_a_curve_without_phases_has_no_alternation(curve: np.ndarray):
    found = alternation(curve, np.random.default_rng(0))
    assert (found.count, found.p) == (0, 1.0)


@pytest.mark.parametrize("correlation", [0.6, 0.95])
def test_wandering_is_seldom_taken_for_cycles(correlation: float):
    random = np.random.default_rng(0)
    p = [alternation(wandering(correlation, 150, seed), random, n_surrogates=19).p for seed in range(100)]
    assert np.mean(np.array(p) <= 0.05) <= 0.1


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: phases(np.zeros((3, 3))), r"at least three finite numbers, \(n,\), got shape \(3, 3\)"),
        (lambda: phases(np.zeros(2)), r"got shape \(2,\)"),
        (lambda: phases(np.array([0.1, np.nan, 0.2])), "finite"),
        (lambda: phases(STEPS, min_length=1), "min_length must be at least 2, got 1"),
    ],
)
def test_bad_input_is_refused(call: Callable[[], object], message: str):
    with pytest.raises(ValueError, match=message):
        call()
