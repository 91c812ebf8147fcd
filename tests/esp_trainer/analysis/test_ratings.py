"""Ratings against known strengths, by hand where there are two teams, and where one side always wins."""

from __future__ import annotations

from collections.abc import Callable
from math import log10

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from esp_trainer.analysis.ratings import Ratings, rate

small = arrays(np.float64, (3, 2), elements=st.integers(0, 10).map(lambda k: k / 10))


def generator() -> np.random.Generator:
    return np.random.default_rng(0)


def test_two_teams_are_rated_by_hand():
    # 90 of 99 caught and a drawn episode: 90.5 to 9.5, and the ratings are as far apart as that, about 0.
    predators, prey = rate([[90 / 99]], 99, generator(), n_resamples=2)
    assert predators.rating - prey.rating == pytest.approx([400 * log10(90.5 / 9.5)])
    assert predators.rating == pytest.approx(-prey.rating)


def test_true_ratings_are_found():
    strong, hard = np.array([-200.0, 0, 300]), np.array([-250.0, 50, 100, 0])
    caught = 1 / (1 + 10 ** (-np.subtract.outer(strong, hard) / 400))
    predators, prey = rate(caught, 1_000_000, generator(), n_resamples=2)
    assert predators.rating == pytest.approx(strong, abs=0.01)  # the mean of all seven is 0
    assert prey.rating == pytest.approx(hard, abs=0.01)


@pytest.mark.slow
def test_intervals_hold_the_true_ratings_95_times_in_100():
    strong, hard = np.linspace(-200, 200, 8), np.linspace(-100, 100, 7)
    caught = 1 / (1 + 10 ** (-np.subtract.outer(strong, hard) / 400))
    random, held = np.random.default_rng(1), []
    for _ in range(60):
        for side, truth in zip(rate(random.binomial(50, caught) / 50, 50, random, 50), (strong, hard), strict=True):
            held.extend((side.low <= truth) & (truth <= side.high))
    assert 0.92 < np.mean(held) < 0.97


@pytest.mark.parametrize(
    "caught", [np.zeros((4, 3)), np.ones((4, 3)), (np.subtract.outer(np.arange(20), np.arange(20)) > 0).astype(float)]
)
def test_ratings_stay_finite_where_a_team_always_or_never_wins(caught: np.ndarray):
    for side in rate(caught, 200, generator(), n_resamples=10):
        assert np.isfinite([side.low, side.rating, side.high]).all()
        assert (side.high - side.low > 10).all()  # never is not known to be never


def test_a_ladder_rises_and_rock_paper_scissors_does_not():
    ladder = (np.subtract.outer(np.arange(5), np.arange(5)) > 0).astype(float)
    predators, prey = rate(ladder, 100, generator(), n_resamples=2)
    assert (np.diff(predators.rating) > 50).all()
    assert (np.diff(prey.rating) > 50).all()
    cycle = np.array([[0.5, 0, 1], [1, 0.5, 0], [0, 1, 0.5]])
    for side in rate(cycle, 100, generator(), n_resamples=2):
        assert side.rating == pytest.approx(np.zeros(3), abs=1e-3)


@given(small)
def test_exchanging_the_sides_exchanges_their_ratings(caught: np.ndarray):
    one, other = (rate(c, 10, generator(), n_resamples=2) for c in (caught, 1 - caught.T))
    assert one.predators.rating == pytest.approx(other.prey.rating, abs=1e-3)
    assert one.prey.rating == pytest.approx(other.predators.rating, abs=1e-3)
    assert sum(side.rating.sum() for side in one) == pytest.approx(0, abs=1e-6)


def test_the_same_generator_gives_the_same_ratings_and_more_episodes_narrower_ones():
    def rated(episodes: int) -> Ratings:
        return rate([[0.3, 0.6], [0.4, 0.8]], episodes, generator()).predators

    for one, other in zip(vars(rated(100)).values(), vars(rated(100)).values(), strict=True):
        np.testing.assert_array_equal(one, other)
    ratio = (rated(100).high - rated(100).low) / (rated(10_000).high - rated(10_000).low)
    assert ratio == pytest.approx([10, 10], rel=0.2)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: rate([0.5], 10, generator()), r"caught must have shape \(G, H\), got \(1,\)"),
        (lambda: rate([[0.5]], 0, generator()), "episodes must be at least 1 .* got 0 and 200"),
        (lambda: rate([[0.5]], 10, generator(), n_resamples=1), "n_resamples 2, got 10 and 1"),
    ],
)
def test_bad_input_is_refused(call: Callable[[], object], message: str):
    with pytest.raises(ValueError, match=message):
        call()


def test_a_number_of_episodes_for_each_pair_may_be_given():
    caught = np.array([[0.5, 0.75], [0.25, 0.5]])
    for number, each in ((64, np.full((2, 2), 64)), (8, np.full((2, 2), 8))):
        for one, other in zip(
            rate(caught, number, np.random.default_rng(0)), rate(caught, each, np.random.default_rng(0)), strict=True
        ):
            assert one.rating.tolist() == other.rating.tolist()
            assert one.low.tolist() == other.low.tolist()


def test_pairs_with_more_episodes_count_for_more():
    """The first predators do well against one prey and badly against another: what was seen more often decides."""
    caught = np.array([[0.9, 0.1], [0.5, 0.5]])
    well, badly = (
        rate(caught, np.array([episodes, [64, 64]]), np.random.default_rng(0)).predators.rating
        for episodes in ([640, 64], [64, 640])
    )
    assert well[0] > well[1]
    assert badly[0] < badly[1]


def test_each_pair_needs_an_episode():
    with pytest.raises(ValueError, match=r"^episodes must be at least 1"):
        rate(np.full((2, 2), 0.5), np.array([[4, 0], [4, 4]]), np.random.default_rng(0))


def test_two_pairs_of_unlike_episodes_are_rated_by_hand():
    """Each has a drawn episode of its own: 90.5 to 9.5 of the first, 6.5 to 3.5 of the second."""
    predators, prey = rate([[90 / 99, 6 / 9]], np.array([[99, 9]]), generator(), n_resamples=2)
    expected = [400 * log10(90.5 / 9.5), 400 * log10(6.5 / 3.5)]
    assert predators.rating - prey.rating == pytest.approx(expected)
