"""Progress measures on matrices whose answer is known."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from esp_trainer.analysis.games import Sides
from esp_trainer.analysis.progress import (
    Progress,
    ciao,
    dominant_generations,
    early_late,
    generalist,
    global_progress,
    historical_progress,
    master_tournament,
    progress,
    two_sided,
)

ROCK_PAPER_SCISSORS = np.array([[0.5, 0, 1], [1, 0.5, 0], [0, 1, 0.5]])
STEPS = np.subtract.outer(np.arange(12), np.arange(12))
LADDER = 0.5 + 0.04 * STEPS  # both sides improve
ONLY_PREDATORS = np.repeat(np.linspace(0, 1, 12)[:, None], 12, axis=1)

squares = st.integers(2, 15).flatmap(
    lambda n: arrays(np.float64, (n, n), elements=st.integers(0, 20).map(lambda k: k / 20))
)


def test_ciao_shows_each_generation_against_its_ancestors():
    nan = np.nan
    predators, prey = ciao([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6], [0.7, 0.8, 0.9]])
    np.testing.assert_allclose(predators, [[0.1, nan, nan], [0.4, 0.5, nan], [0.7, 0.8, 0.9]])
    np.testing.assert_allclose(prey, [[0.9, nan, nan], [0.8, 0.5, nan], [0.7, 0.4, 0.1]])


def test_the_master_tournament_is_the_mean_against_all():
    predators, prey = master_tournament([[0.0, 0.2, 0.4], [0.6, 0.8, 1.0]])
    assert predators == pytest.approx([0.2, 0.8])
    assert prey == pytest.approx([0.7, 0.5, 0.3])


def test_on_a_ladder_every_generation_is_dominant():
    assert dominant_generations(LADDER) == list(range(12))


def test_in_rock_paper_scissors_dominance_ends_after_two():
    # 1 beats 0; 2 beats 1, but loses to 0.
    assert dominant_generations(ROCK_PAPER_SCISSORS) == [0, 1]


def test_a_dominant_generation_needs_to_beat_dominant_ones_only():
    caught = np.full((4, 4), 0.5)
    caught[2, 0] = 0.6  # 1 draws with 0: not dominant; 2 beats 0
    caught[1, 3] = 0.9  # 3 beats 0 and 2, but loses to 1, who does not count
    caught[3, 0] = caught[3, 2] = 0.7
    assert dominant_generations(caught) == [0, 2, 3]


def test_a_margin_asks_for_more_than_noise():
    # By hand: 100 episodes, 11 comparisons: 2.61 standard errors of some 0.07, so a difference above 0.18.
    assert dominant_generations(LADDER, episodes=100) == [0, 3, 6, 9]
    assert dominant_generations(LADDER, episodes=1_000_000) == list(range(12))
    assert dominant_generations(LADDER, episodes=100, error=1e-9)[1] > 3


def test_without_progress_a_second_dominant_generation_is_rare():
    generator = np.random.default_rng(0)
    runs = [generator.binomial(100, np.full((30, 30), 0.3)) / 100 for _ in range(200)]
    assert np.mean([len(dominant_generations(run, episodes=100)) > 1 for run in runs]) < 0.1
    assert np.mean([len(dominant_generations(run)) > 1 for run in runs]) > 0.9


def test_progress_is_late_less_early():
    # Sixths of 12 are two generations.
    results = np.array([0.0, 0.2] + [0.5] * 8 + [0.8, 0.6])[:, None] * [1.0, 0.5]
    made = progress(results)
    assert made.curve == pytest.approx(results.mean(axis=1))
    assert made.strength == pytest.approx(0.75 * 0.7 - 0.75 * 0.1)


@pytest.mark.parametrize(("n", "sixth"), [(2, 1), (5, 1), (11, 1), (12, 2), (17, 2), (18, 3)])
def test_a_sixth_is_rounded_down_to_at_least_one(n: int, sixth: int):
    made = progress(np.arange(n)[:, None] / n)
    assert made.strength == pytest.approx((n - sixth) / n)


@pytest.mark.parametrize(("curve", "tau"), [([1, 2, 3, 4], 1), ([4, 3, 2, 1], -1), ([1, 3, 2, 4], 2 / 3)])
def test_kendalls_tau_counts_pairs_in_order(curve: list[int], tau: float):
    assert progress(np.array(curve)[:, None] / 10).tau == pytest.approx(tau)


def test_the_same_results_in_another_order_are_no_trend():
    results = np.array([[0.3, 0.2, 0.1], [0.2, 0.3, 0.1], [0.1, 0.2, 0.3], [0.1, 0.2, 0.3]])
    assert np.ptp(results.mean(axis=1)) > 0  # by rounding, and with a trend
    assert progress(results).tau == 0


def test_on_a_ladder_both_sides_progress():
    both = historical_progress(LADDER)
    # Means of the first and last two of 12 are ten generations apart.
    assert (both.predators.strength, both.prey.strength) == pytest.approx((0.4, 0.4))
    assert (both.predators.tau, both.prey.tau) == pytest.approx((1, 1))
    assert two_sided(both) == pytest.approx(0.4)


def test_one_sided_progress_is_not_two_sided():
    both = historical_progress(ONLY_PREDATORS)
    assert both.predators.strength == pytest.approx(10 / 11)
    assert both.prey.strength == 0
    assert both.prey.tau == 0
    assert two_sided(both) == 0


def test_a_cycle_is_no_progress():
    both = historical_progress(np.kron(np.ones((4, 4)), ROCK_PAPER_SCISSORS))
    assert (both.predators.strength, both.prey.strength, both.predators.tau) == (0, 0, 0)


@given(squares)
def test_historical_progress_is_the_master_tournaments(caught: np.ndarray):
    for made, curve in zip(historical_progress(caught), master_tournament(caught), strict=True):
        assert made.curve == pytest.approx(curve)


@given(squares)
def test_exchanging_the_sides_exchanges_their_progress(caught: np.ndarray):
    one, other = historical_progress(caught), historical_progress(1 - caught.T)
    assert one.predators.strength == pytest.approx(other.prey.strength)
    assert one.prey.tau == pytest.approx(other.predators.tau)


def test_global_progress_is_against_all_other_seeds_together():
    rising, falling, flat = np.array([[0.2], [0.8]]), np.array([[0.9, 0.1]]), np.full((2, 3), 0.5)
    both = global_progress([rising, flat], [falling, flat[:, :2]])
    # One of four opponents rises by 0.6; prey: one of three predators catches 0.8 less.
    assert both.predators.strength == pytest.approx(0.6 / 4)
    assert both.prey.strength == pytest.approx(0.8 / 3)


def test_what_was_learned_of_own_opponents_is_not_global():
    own, others = LADDER, np.full((12, 12), 0.5)
    assert two_sided(historical_progress(own)) > 0.3
    assert two_sided(global_progress([others], [others])) == 0


def test_two_sided_progress_is_that_of_the_lesser_side():
    curve = np.zeros(2)
    assert two_sided(Sides(Progress(curve, 0.3, 1), Progress(curve, -0.2, -1))) == -0.2


def test_early_and_late_are_the_corners():
    corners = early_late(np.arange(144).reshape(12, 12) / 144)
    # The mean of a 2 x 2 block is its first entry + 6.5.
    assert corners.early_hunt_early == pytest.approx(6.5 / 144)
    assert corners.early_hunt_late == pytest.approx(16.5 / 144)
    assert corners.late_hunt_early == pytest.approx(126.5 / 144)
    assert corners.late_hunt_late == pytest.approx(136.5 / 144)


def test_the_sides_may_have_different_generations():
    corners = early_late(np.linspace(0, 1, 12)[:, None] * np.ones(3))
    assert corners.late_hunt_early == corners.late_hunt_late == pytest.approx(10.5 / 11)


def test_a_generalist_is_scored_by_its_worst_tenth_too():
    results = np.array([np.arange(20) / 20, np.full(20, 0.5)])
    scores = generalist(results[:, ::-1])
    assert scores.mean == pytest.approx([0.475, 0.5])
    assert scores.worst == pytest.approx([0.025, 0.5])  # 0 and 0.05
    assert generalist([[0.3, 0.6]]).worst == pytest.approx([0.3])  # at least one


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: ciao(np.zeros((2, 3))), r"same generations on both sides, got shape \(2, 3\)"),
        (lambda: progress(np.zeros(3)), r"results must have shape \(G, H\), got \(3,\)"),
        (lambda: progress(np.zeros((1, 3))), "at least two generations, got 1"),
        (lambda: generalist(np.full((2, 2), 1.5)), r"results must lie in \[0, 1\], got 1.5 to 1.5"),
        (lambda: global_progress([LADDER, LADDER[:5]], [LADDER]), r"predators_met must .* got \[12, 5\] of them"),
        (lambda: global_progress([LADDER], []), r"prey_met must .* got \[\] of them"),
        (lambda: dominant_generations(LADDER, episodes=0), "episodes must be at least 1 .* got 0"),
        (lambda: dominant_generations(LADDER, episodes=9, error=0), r"error in \(0, 1\), got 9 and 0"),
    ],
)
def test_bad_input_is_refused(call: Callable[[], object], message: str):
    with pytest.raises(ValueError, match=message):
        call()
