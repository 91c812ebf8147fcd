"""Intervals against published values, and counts by hand."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from esp_trainer.statistics import Rate, count_captures, wilson
from esp_trainer.types import TrialResult


@pytest.mark.parametrize(
    ("successes", "n", "low", "high"),
    [
        # Newcombe, Two-sided confidence intervals for the single proportion, Statistics in Medicine 17 (1998),
        # table I, method 3.
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0000, 0.1611),
        (1, 29, 0.0061, 0.1718),
        # By hand: z^2 = 3.8415, so 0 of 10 gives z^2 / (10 + z^2), and 5 of 10 gives 1/2 -+ z / (2 sqrt(10 + z^2)).
        (0, 10, 0.0000, 0.2775),
        (5, 10, 0.2366, 0.7634),
        (10, 10, 0.7225, 1.0000),
    ],
)
def test_wilson_gives_the_published_intervals(successes: int, n: int, low: float, high: float):
    rate = wilson(successes, n)
    assert rate.rate == successes / n
    assert rate.low == pytest.approx(low, abs=5e-5)
    assert rate.high == pytest.approx(high, abs=5e-5)


@given(st.integers(1, 2000).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_a_rate_lies_in_its_interval(sample: tuple[int, int]):
    rate = wilson(*sample)
    assert 0 <= rate.low <= rate.rate <= rate.high <= 1


@pytest.mark.parametrize("n", [7, 10, 13, 200])
def test_intervals_of_none_and_all_reach_the_end(n: int):
    assert wilson(0, n).low == 0.0
    assert wilson(n, n).high == 1.0


@given(st.integers(1, 500).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_intervals_of_successes_and_failures_mirror_each_other(sample: tuple[int, int]):
    successes, n = sample
    one, other = wilson(successes, n), wilson(n - successes, n)
    assert one.low == pytest.approx(1 - other.high, abs=1e-12)
    assert one.high == pytest.approx(1 - other.low, abs=1e-12)


def test_more_episodes_narrow_the_interval():
    widths = [wilson(n // 4, n).high - wilson(n // 4, n).low for n in (8, 40, 200, 1000)]
    assert widths == sorted(widths, reverse=True)


def test_a_rate_reads_as_a_share_and_its_interval():
    assert str(wilson(5, 10)) == "0.500 [0.237, 0.763]"


# Two trials of two episodes with two predators and two prey.
RESULT = TrialResult(
    fitness=np.array(
        [[[25.0, 25.0, 5.0, 5.0], [10.0, 12.0, 12.5, 12.5]], [[2.0, 4.0, 25.0, 25.0], [11.0, 11.0, 12.5, 12.5]]]
    ),
    captured=np.array([[[True, True], [True, False]], [[False, False], [False, True]]]),
    steps=np.array([[60, 150], [150, 140]]),
)
EVEN = np.array([[[2, 2], [1, 0]], [[0, 1], [1, 2]]])


def test_captures_are_counted_by_hand():
    captures = count_captures(RESULT, EVEN, n_predators=2)
    assert captures.episodes == 4
    assert captures.predators_succeed == wilson(1, 4)
    assert captures.prey_succeed == wilson(1, 4)
    # A rate is over prey, its interval over the episodes that they come from.
    assert captures.caught == wilson(2, 4)
    assert captures.caught_by_even == [wilson(0, 2), wilson(1, 3), wilson(2, 2)]
    assert captures.steps == 125.0
    assert captures.predator_fitness == 100 / 8
    assert captures.prey_fitness == 110 / 8


def test_a_parity_that_no_prey_had_has_no_rate():
    captures = count_captures(RESULT, np.zeros_like(EVEN), n_predators=2)
    assert captures.caught_by_even == [wilson(2, 4), None, None]


def test_captures_become_json_and_back():
    captures = count_captures(RESULT, EVEN, n_predators=2)
    values = json.loads(json.dumps(captures.as_dict()))
    assert Rate(**values["caught"]) == captures.caught
    assert values["steps"] == 125.0
    assert len(values["caught_by_even"]) == 3
