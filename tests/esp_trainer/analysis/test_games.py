"""Games whose solution and whose cyclic share are known: rock-paper-scissors, a ladder, mixtures of both."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.special import expit

from esp_trainer.analysis.games import (
    PayoffScale,
    as_shares,
    as_square,
    decompose,
    exploitability_of_generations,
    mixture_exploitability,
    solve_matrix,
)

CYCLE = np.array([[0, -1, 1], [1, 0, -1], [-1, 1, 0]])
ROCK_PAPER_SCISSORS = 0.5 + 0.5 * CYCLE
STEPS = np.subtract.outer(np.arange(3), np.arange(3))  # g - h
LADDER = 0.5 + 0.2 * STEPS
MIXTURE = 0.5 + 0.1 * STEPS + 0.2 * CYCLE

games = st.tuples(st.integers(2, 6), st.integers(2, 6)).flatmap(
    lambda shape: arrays(np.float64, shape, elements=st.integers(0, 20).map(lambda k: k / 20))
)


def test_rock_paper_scissors_mixes_all_three_alike():
    equilibrium = solve_matrix(ROCK_PAPER_SCISSORS)
    assert equilibrium.value == pytest.approx(0.5)
    assert equilibrium.predators == pytest.approx(np.full(3, 1 / 3))
    assert equilibrium.prey == pytest.approx(np.full(3, 1 / 3))
    assert equilibrium.support == (3, 3)


def test_on_a_ladder_the_last_generation_plays_alone():
    equilibrium = solve_matrix(LADDER)
    assert equilibrium.value == pytest.approx(0.5)
    assert equilibrium.predators == pytest.approx([0, 0, 1])
    assert equilibrium.prey == pytest.approx([0, 0, 1])
    assert equilibrium.support == (1, 1)


def test_a_game_of_unlike_sides_is_solved_by_hand():
    # Rows mixed by (p, 1 - p) get 4p - 1 and 1 - 2p from the first two columns: alike at p = 1/3, both 1/3. The
    # matrix of these is its own transpose, so columns mix alike; nobody plays the third.
    equilibrium = solve_matrix(np.array([[3.0, -1.0, 3.0], [-1.0, 1.0, 3.0]]))
    assert equilibrium.value == pytest.approx(1 / 3)
    assert equilibrium.predators == pytest.approx([1 / 3, 2 / 3])
    assert equilibrium.prey == pytest.approx([1 / 3, 2 / 3, 0])


@given(games)
def test_an_equilibrium_cannot_be_exploited(payoffs: np.ndarray):
    equilibrium = solve_matrix(payoffs)
    assert equilibrium.predators.sum() == pytest.approx(1)
    assert equilibrium.prey.sum() == pytest.approx(1)
    assert mixture_exploitability(payoffs, equilibrium.predators, equilibrium.prey) == pytest.approx((0, 0), abs=1e-9)
    assert all((side > -1e-9).all() for side in exploitability_of_generations(payoffs))


@given(games)
def test_the_sides_of_a_game_can_be_exchanged(payoffs: np.ndarray):
    assert solve_matrix(-payoffs.T).value == pytest.approx(-solve_matrix(payoffs).value, abs=1e-9)


def test_a_best_response_takes_what_it_can():
    # Rock meets paper: predators fall from 1/2 to 0, prey from 1/2 to 1. On the ladder by 0.2 for each step to the top.
    assert np.allclose(exploitability_of_generations(ROCK_PAPER_SCISSORS), 0.5)
    assert np.allclose(exploitability_of_generations(LADDER), [0.4, 0.2, 0])
    half = np.array([0.5, 0.5, 0])  # such predators get 0.75, 0.25 and 0.5, and the prey the same
    assert mixture_exploitability(ROCK_PAPER_SCISSORS, half, half) == pytest.approx((0.25, 0.25))


@pytest.mark.parametrize(
    ("caught", "share"),
    # The mixture's ladder: 0.01 * (4 * 1 + 2 * 4) = 0.12; its cycle: 6 * 0.04 = 0.24.
    [(ROCK_PAPER_SCISSORS, 0.0), (LADDER, 1.0), (MIXTURE, 1 / 3)],
)
def test_the_transitive_share_is_known(caught: np.ndarray, share: float):
    assert decompose(caught).transitive_share == pytest.approx(share)


def test_the_parts_are_mean_squares():
    parts = decompose(MIXTURE)
    assert (parts.transitive, parts.cyclic) == pytest.approx((0.12 / 9, 0.24 / 9))


def test_that_one_role_is_easier_ranks_nobody():
    assert decompose(MIXTURE + 0.05).transitive_share == pytest.approx(1 / 3)
    assert np.isnan(decompose(np.full((4, 3), 0.9)).transitive_share)


def test_specialists_are_cyclic():
    own_time_only = np.eye(4)
    assert decompose(own_time_only).transitive_share == 0


def test_a_bradley_terry_ladder_is_additive_in_log_odds_only():
    caught = expit(np.subtract.outer(np.arange(-3.0, 4), np.arange(-2.0, 3)))
    assert decompose(caught, scale="log-odds").transitive_share == pytest.approx(1)
    assert 0.8 < decompose(caught).transitive_share < 0.99


@given(games)
def test_the_sides_decompose_alike(caught: np.ndarray):
    one, other = decompose(caught), decompose(1 - caught.T)
    assert (one.transitive, one.cyclic) == pytest.approx((other.transitive, other.cyclic), abs=1e-12)
    assert one.transitive + one.cyclic == pytest.approx(caught.var(), abs=1e-12)


@pytest.mark.parametrize(("scale", "tolerance"), [("shares", 0.03), ("log-odds", 0.06)])
def test_sampling_noise_is_taken_off(scale: PayoffScale, tolerance: float):
    caught, generator = np.kron(np.ones((4, 4)), MIXTURE), np.random.default_rng(3)
    truth = decompose(caught, scale=scale)
    samples = [decompose(generator.binomial(20, caught) / 20, 20, scale) for _ in range(300)]
    assert np.mean([s.transitive for s in samples]) == pytest.approx(truth.transitive, rel=tolerance)
    assert np.mean([s.cyclic for s in samples]) == pytest.approx(truth.cyclic, rel=tolerance)


def test_the_noise_of_a_small_game_is_worked_out_by_hand():
    # Mean 0.5, rows and columns +-0.1: a ladder of 0.2, 0, 0, -0.2 and a rest of +-0.2, in squares 0.02 and 0.04. The
    # variances p (1 - p) / 10 are 0.009, 0.021, 0.021, 0.025, in the mean 0.019: half is the ladder's, a quarter the
    # rest's, a quarter the overall mean's.
    parts = decompose(np.array([[0.9, 0.3], [0.3, 0.5]]), episodes=11)
    assert (parts.transitive, parts.cyclic) == pytest.approx((0.02 - 0.019 / 2, 0.04 - 0.019 / 4))


def test_what_is_less_than_noise_is_nothing():
    parts = decompose(np.full((4, 4), 0.5), episodes=10)
    assert (parts.transitive, parts.cyclic) == (0, 0)


def test_noise_about_a_ladder_is_no_cycle():
    caught = np.clip(0.5 + 0.04 * np.subtract.outer(np.arange(12), np.arange(12)), 0, 1)
    sampled = np.random.default_rng(0).binomial(50, caught) / 50
    assert decompose(sampled, 50).transitive_share > 0.98 > decompose(sampled).transitive_share


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: as_shares(np.zeros(3)), r"caught must have shape \(G, H\), got \(3,\)"),
        (lambda: as_shares(np.zeros((0, 3))), r"got \(0, 3\)"),
        (lambda: as_shares(np.array([[0.5, 1.5]])), r"caught must lie in \[0, 1\], got 0.5 to 1.5"),
        (lambda: as_shares(np.array([[-0.5, 0.5]])), r"caught must lie in \[0, 1\], got -0.5 to 0.5"),
        (lambda: as_shares(np.array([[0.5, np.nan]])), r"caught must lie in \[0, 1\], got nan to nan"),
        (lambda: as_square(np.zeros((2, 3))), r"same generations on both sides, got shape \(2, 3\)"),
        (lambda: decompose(np.zeros((1, 3))), r"at least two generations of each side, got shape \(1, 3\)"),
        (lambda: decompose(LADDER, episodes=1), "episodes must be at least 2, got 1"),
        (lambda: decompose(ROCK_PAPER_SCISSORS, scale="log-odds"), "need the number of episodes, got None"),
    ],
)
def test_bad_input_is_refused(call: Callable[[], object], message: str):
    with pytest.raises(ValueError, match=message):
        call()
