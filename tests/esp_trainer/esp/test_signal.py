"""How much selection has to go by: by hand, and on fitness of which the true share is known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from esp_trainer.esp.signal import Variance, ties


def share(chosen: np.ndarray, fitness: np.ndarray, size: int) -> float:
    variance = Variance()
    variance.add(chosen, fitness, size)
    return variance.share()


def test_the_share_by_hand():
    """Means 2 and 6, deviations of 1: between 16 with one degree of freedom, within 4 with two."""
    assert share(np.array([[0], [0], [1], [1]]), np.array([1.0, 3.0, 5.0, 7.0]), 3) == pytest.approx(1 - 2 / 16)


def test_all_is_signal_where_a_neuron_decides_alone():
    assert share(np.array([[0], [0], [1], [1]]), np.array([1.0, 1.0, 5.0, 5.0]), 2) == 1.0


def test_nothing_is_where_all_trials_end_alike():
    assert share(np.array([[0], [0], [1], [1]]), np.full(4, 25.0), 2) == 0.0


@pytest.mark.parametrize("chosen", [[[0], [1], [2]], [[0], [0], [0]], [[0]]])
def test_the_share_is_unknown_where_neurons_cannot_be_told_from_luck(chosen: list[list[int]]):
    assert math.isnan(share(np.array(chosen), np.arange(len(chosen), dtype=float), 3))


def test_the_share_is_that_of_the_variance_of_the_means():
    """Effects with a variance of 1 and noise of 10 in some 20 trials a neuron: 1 / (1 + 10 / 20) of it is signal."""
    generator = np.random.default_rng(0)
    chosen = generator.integers(0, 50, (1000, 40))
    found = []
    for subpopulation in chosen.T:
        effects = generator.normal(0, 1, 50)
        fitness = effects[subpopulation] + generator.normal(0, math.sqrt(10), 1000)
        found.append(share(subpopulation[:, None], fitness, 50))
    assert np.mean(found) == pytest.approx(2 / 3, abs=0.03)


def test_without_an_effect_it_is_zero_on_the_average():
    generator = np.random.default_rng(0)
    chosen = generator.integers(0, 100, (1000, 400))
    assert share(chosen, generator.normal(0, 1, 1000), 100) == pytest.approx(0, abs=0.02)


def test_agents_are_pooled_by_their_degrees_of_freedom():
    variance = Variance()
    variance.add(np.array([[0], [0], [1], [1]]), np.array([1.0, 3.0, 5.0, 7.0]), 2)  # between 16, within 4
    variance.add(np.array([[0], [0], [1], [1]]), np.array([1.0, 3.0, 1.0, 3.0]), 2)  # between 0, within 4
    assert variance.share() == pytest.approx(1 - (8 / 4) / (16 / 2))


def test_a_constant_added_to_the_fitness_changes_nothing():
    chosen, fitness = np.array([[0], [0], [1], [1]]), np.array([1.0, 3.0, 5.0, 7.0])
    assert share(chosen, fitness + 1e6, 2) == pytest.approx(share(chosen, fitness, 2), rel=1e-9)


def test_ties_are_the_trials_with_the_most_frequent_fitness():
    assert ties(np.array([[25.0], [25.0], [12.5], [25.0]])) == 0.75
    assert ties(np.array([[25.0, 1.0], [25.0, 2.0]])) == 0.75  # 1 of one agent, 1/2 of the other
