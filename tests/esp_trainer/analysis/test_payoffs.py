"""The measures of an arms race for payoffs of any scale, with their sampling variance."""

from __future__ import annotations

import numpy as np
import pytest

from esp_trainer.analysis.games import as_results, decompose, solve_matrix, transitive_share
from esp_trainer.analysis.progress import (
    ciao,
    dominant_generations,
    early_late,
    global_progress,
    historical_progress,
    master_tournament,
    two_sided,
)
from esp_trainer.statistics import Payoffs, mean_of, results_in_short, summarise
from esp_trainer.types import TrialResult

RISING = np.arange(6.0)
LADDER = 10 * RISING[:, None] - 4 * RISING  # late predators are paid more, late prey pay less
CYCLE = 5.0 * np.array([[0, -1, 1], [1, 0, -1], [-1, 1, 0]])


def test_both_sides_gain_what_their_generations_add() -> None:
    both = historical_progress(LADDER, 0.0)
    assert (both.predators.strength, both.prey.strength) == (50.0, 20.0)
    assert (both.predators.tau, both.prey.tau) == pytest.approx((1.0, 1.0))
    assert two_sided(both) == 20.0
    assert both.predators.level == pytest.approx(50 - 4 * 2.5)
    assert both.prey.level == pytest.approx(-(10 * 2.5 - 20))


def test_a_payoff_to_one_side_is_a_loss_to_the_other() -> None:
    both = master_tournament(LADDER, 0.0)
    assert both.predators.tolist() == LADDER.mean(axis=1).tolist()
    assert both.prey.tolist() == (-LADDER.mean(axis=0)).tolist()
    corners = early_late(LADDER, 0.0)
    assert (corners.early_hunt_early, corners.late_hunt_early) == (0.0, 50.0)
    assert (corners.early_hunt_late, corners.late_hunt_late) == (-20.0, 30.0)
    assert ciao(LADDER, 0.0).prey[1, :2].tolist() == [4.0, -6.0]
    against = global_progress([LADDER[:, :2]], [LADDER[:3]], 0.0)
    assert (against.predators.strength, against.prey.strength) == (50.0, 20.0)


def test_payoffs_need_their_total() -> None:
    with pytest.raises(ValueError, match=r"caught must lie in \[0, 1\], got -20.0 to 50.0"):
        historical_progress(LADDER)
    with pytest.raises(ValueError, match=r"payoffs must hold finite numbers, \(G, H\), got shape \(2, 2\)"):
        as_results(np.array([[1.0, np.inf], [0.0, 0.0]]), total=0.0)


def test_a_ladder_of_payoffs_is_all_transitive_and_a_cycle_is_not() -> None:
    assert transitive_share(LADDER, np.zeros((6, 6))) == pytest.approx(1)
    assert transitive_share(CYCLE, np.zeros((3, 3))) == pytest.approx(0)
    assert np.isnan(transitive_share(LADDER, np.full((6, 6), np.nan)))
    noise = np.full((3, 3), 2.0)
    exact, noisy = decompose(CYCLE, np.zeros((3, 3))), decompose(CYCLE, noise)
    assert exact.cyclic - noisy.cyclic == pytest.approx(2 * (1 - 1 / 3) ** 2)  # the residuals' share of the noise
    with pytest.raises(ValueError, match="payoffs with a sampling variance have no log-odds"):
        decompose(CYCLE, noise, "log-odds")


def test_the_game_is_solved_in_units_of_the_payoff() -> None:
    assert solve_matrix(CYCLE + 7).value == pytest.approx(7)


def test_a_generation_dominates_if_its_lead_exceeds_the_noise() -> None:
    rising = 10 * RISING[:, None] + 0 * RISING
    assert dominant_generations(rising, np.zeros((6, 6))) == [0, 1, 2, 3, 4, 5]
    # The margin is 2.33 standard errors of a difference: 2.33 sqrt(2 v) with 5 later generations.
    assert dominant_generations(rising, np.full((6, 6), 9.1)) == [0, 1, 2, 3, 4, 5]
    assert dominant_generations(rising, np.full((6, 6), 9.4)) == [0, 2, 4]


def test_episodes_are_summarised_by_payoffs() -> None:
    fitness = np.array([[[4.0, 2.0, -3.0]], [[0.0, 2.0, -1.0]]])
    result = TrialResult(fitness, np.zeros((2, 1, 1), bool), np.array([[5], [7]]), np.array([[3.0], [1.0]]))
    found = summarise(result, np.zeros((2, 1, 1), int))
    assert isinstance(found, Payoffs)
    assert (found.episodes, found.steps, found.predator_fitness, found.prey_fitness) == (2, 6.0, 2.0, -2.0)
    assert found.payoff.rate == 2.0
    assert found.payoff.high - found.payoff.rate == pytest.approx(1.96, rel=1e-4)  # standard error 1
    assert results_in_short(found.as_dict()) == "payoff 2.00"
    assert mean_of(np.array([4.0])) == mean_of(np.array([[4.0]]))
    assert mean_of(np.array([4.0])).low == 4.0
