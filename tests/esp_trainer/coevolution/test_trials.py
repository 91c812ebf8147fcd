"""What trials bring: by hand."""

from __future__ import annotations

import numpy as np
import pytest

from esp_trainer.coevolution.sharing import share_fitness
from esp_trainer.coevolution.trials import Part, by_block, centred, ranked, summarise_trials
from esp_trainer.config import EspConfig
from esp_trainer.types import EvolvedTeams, ScriptedTeams, TrialResult

RANDOM = ScriptedTeams("random")
PRESENT = Part(np.array([[[4.0], [2.0]], [[0.0], [0.0]]]), np.array([[1.0, 0.5], [0.0, 0.0]]), 3 / 8, RANDOM)
PAST = Part(np.array([[[9.0]], [[3.0]]]), np.array([[1.0], [0.5]]), 3 / 4, RANDOM, past=np.array([[0], [1]]))


def test_trials_are_means_over_all_their_episodes():
    trials = summarise_trials([PRESENT, PAST], EspConfig())
    assert trials.fitness.tolist() == [[5.0], [1.0]]
    assert trials.earned.tolist() == [[5.0], [1.0]]
    assert trials.payoff == 3 / 6


def test_what_counts_in_a_block_is_the_difference_from_its_mean():
    trials = summarise_trials([PRESENT, PAST], EspConfig(block_size=2))
    assert trials.fitness.tolist() == [[5.0], [1.0]]
    assert trials.earned.tolist() == [[2.0], [-2.0]]


@pytest.mark.parametrize(
    ("block_size", "expected"), [(1, [1, 2, 6, 7, 9]), (2, [-0.5, 0.5, -0.5, 0.5, 0]), (5, [-4, -3, 1, 2, 4])]
)
def test_blocks_are_trials_in_turn_and_the_last_may_be_shorter(block_size: int, expected: list[float]):
    fitness = np.array([[1.0], [2.0], [6.0], [7.0], [9.0]])
    assert centred(fitness, block_size).ravel().tolist() == expected


def test_a_row_for_each_block_is_one_for_each_of_its_trials():
    assert by_block(np.array([[1, 2], [3, 4]]), 2, 3).tolist() == [[1, 2], [1, 2], [3, 4]]
    assert by_block(np.array([[1], [2], [3]]), 1, 3).tolist() == [[1], [2], [3]]


def test_a_part_with_an_opponent_for_each_episode_takes_them_apart_again():
    fitness = np.arange(12.0).reshape(
        6, 1, 2
    )  # three trials of two episodes, one after the other; a predator and a prey
    captured = np.array([1, 0, 0, 1, 1, 1], bool).reshape(6, 1, 1)
    part = Part.of(TrialResult(fitness, captured, np.ones((6, 1), int)), "prey", RANDOM, np.zeros((3, 2)))
    assert part.fitness.tolist() == [[[1.0], [3.0]], [[5.0], [7.0]], [[9.0], [11.0]]]
    assert part.payoff.tolist() == [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]
    assert part.mean_payoff == 4 / 6


def test_the_payoff_of_three_prey_is_the_mean_over_all_prey_at_once():
    captured = np.array([[[1, 0, 0]], [[1, 1, 0]], [[0, 0, 0]]], bool)
    part = Part.of(TrialResult(np.zeros((3, 1, 4)), captured, np.ones((3, 1), int)), "prey", RANDOM)
    assert part.payoff.ravel().tolist() == [1 / 3, 2 / 3, 0.0]
    assert part.mean_payoff == 3 / 9
    assert part.is_share


def test_payoffs_of_any_scale_become_wins_by_their_ranks():
    assert ranked(np.array([[30.0, -5.0], [7.0, 30.0]])).tolist() == [[2.5 / 3, 0.0], [1 / 3, 2.5 / 3]]
    assert ranked(np.full((2, 2), 4.0)).tolist() == [[0.5, 0.5], [0.5, 0.5]]
    assert ranked(np.array([[4.0]])).tolist() == [[0.5]]
    paid = TrialResult(np.zeros((1, 2, 2)), np.zeros((1, 2, 1), bool), np.ones((1, 2), int), np.array([[30.0, -5.0]]))
    part = Part.of(paid, "predators", RANDOM, np.zeros((1, 2), int))
    assert (part.payoff.tolist(), part.mean_payoff, part.is_share) == ([[30.0, -5.0]], 12.5, False)


def test_shares_are_weighted_by_the_episodes_of_their_parts():
    """Two opponents in turn: a trial's share is of what was earned against its own."""
    genomes, indices = np.zeros((1, 1, 1, 2, 1), np.float32), np.array([0, 1, 0, 0]).reshape(4, 1, 1, 1)
    opponents = EvolvedTeams(None, genomes, indices)  # type: ignore[arg-type]  # nobody plays
    past = Part(
        np.array([[[1.0], [2.0]], [[3.0], [4.0]]]), np.zeros((2, 2)), 0.0, opponents, past=np.array([[0, 1], [0, 0]])
    )
    each = share_fitness(np.array([[1.0], [2.0], [3.0], [4.0]]), opponents).ravel()
    assert past.shared().ravel().tolist() == [each[:2].mean(), each[2:].mean()]
    trials = summarise_trials([PRESENT, past], EspConfig(fitness_sharing=True))
    expected = (2 * np.array([3.0, 0.0]) + 2 * past.shared().ravel()) / 4  # of a script the fitness itself
    assert trials.earned.ravel() == pytest.approx(expected)
