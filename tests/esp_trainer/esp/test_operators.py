"""The genetic operators, by hand and on any input."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from esp_trainer.esp.operators import (
    draw_mates,
    mutate,
    one_point_crossover,
    ranking,
    sums_by_neuron,
    truncated_cauchy,
)

INF = float("inf")


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


# -- fitness and ranks -----------------------------------------------------------------------------------------------


def test_a_neurons_trials_are_summed():
    chosen = np.array([[0, 2], [1, 2], [0, 0], [0, 2]])
    totals, trials = sums_by_neuron(chosen, np.array([1.0, 2.0, 3.0, 6.0]), 4)
    assert totals.tolist() == [[10.0, 2.0, 0.0, 0.0], [3.0, 0.0, 9.0, 0.0]]
    assert trials.tolist() == [[3, 1, 0, 0], [1, 0, 3, 0]]


@given(st.integers(1, 30), st.integers(1, 4), st.integers(1, 6), st.integers(0, 100))
def test_sums_by_neuron_equal_a_plain_loop(n_trials: int, n_subpopulations: int, size: int, seed: int):
    chosen = rng(seed).integers(0, size, (n_trials, n_subpopulations))
    fitness = rng(seed + 1).integers(0, 100, n_trials) / 4  # sums are exact
    totals, trials = sums_by_neuron(chosen, fitness, size)
    for subpopulation in range(n_subpopulations):
        for neuron in range(size):
            own = fitness[chosen[:, subpopulation] == neuron]
            assert (totals[subpopulation, neuron], trials[subpopulation, neuron]) == (own.sum(), len(own))


def test_ranking_goes_from_best_to_worst_and_leaves_equals_in_order():
    fitness = np.array([[2.0, 5.0, 2.0, -INF, 5.0, -INF], [0.0, 0.0, 0.0, 0.0, 0.0, 1.0]])
    assert ranking(fitness).tolist() == [[1, 4, 0, 2, 3, 5], [5, 0, 1, 2, 3, 4]]


# -- mates -------------------------------------------------------------------------------------------------------------


def test_uniform_mates_are_any_of_the_elite():
    mates = draw_mates(rng(), 2000, 5, "uniform")
    assert mates.shape == (2000, 5)
    for rank in range(5):
        counts = np.bincount(mates[:, rank], minlength=5)
        assert len(counts) == 5
        assert (abs(counts / 2000 - 0.2) < 0.05).all()


def test_better_ranked_mates_never_rank_below_their_partner():
    mates = draw_mates(rng(), 2000, 5, "better_ranked")
    assert mates.shape == (2000, 5)
    for rank in range(5):
        counts = np.bincount(mates[:, rank])
        assert len(counts) == rank + 1
        assert (abs(counts / 2000 - 1 / (rank + 1)) < 0.05).all()


@pytest.mark.parametrize("mate", ["uniform", "better_ranked"])
def test_an_elite_of_one_mates_with_itself(mate: Literal["uniform", "better_ranked"]):
    assert (draw_mates(rng(), 10, 1, mate) == 0).all()


# -- crossover ---------------------------------------------------------------------------------------------------------


def all_zeros_and_all_ones(n_subpopulations: int, n_pairs: int, n_genes: int) -> tuple[np.ndarray, np.ndarray]:
    shape = (n_subpopulations, n_pairs, n_genes)
    return np.zeros(shape, np.float32), np.ones(shape, np.float32)


def used(n_subpopulations: int, n_genes: int) -> np.ndarray:
    return np.full(n_subpopulations, n_genes)


def all_genes(children: np.ndarray) -> np.ndarray:
    return used(len(children), children.shape[-1])


def test_the_first_child_begins_like_the_first_parent():
    children = one_point_crossover(rng(), *all_zeros_and_all_ones(3, 200, 7), used(3, 7))
    first, second = children[:, 0::2], children[:, 1::2]
    assert (first[..., 0] == 0).all()
    assert (first[..., -1] == 1).all()
    assert (np.diff(first) >= 0).all()  # one cut
    assert (second == 1 - first).all()


def test_the_cut_is_uniform_over_all_places_that_leave_each_parent_a_gene():
    children = one_point_crossover(rng(), *all_zeros_and_all_ones(1, 6000, 7), used(1, 7))
    cuts = (children[0, 0::2] == 0).sum(axis=1)
    counts = np.bincount(cuts, minlength=8)
    assert counts[0] == counts[7] == 0
    assert (abs(counts[1:7] - 1000) < 150).all()


def test_every_pair_is_cut_at_a_place_of_its_own():
    children = one_point_crossover(rng(), *all_zeros_and_all_ones(4, 50, 20), used(4, 20))
    cuts = (children[:, 0::2] == 0).sum(axis=2)
    assert len({tuple(row) for row in cuts}) == 4
    assert all(len(set(row)) > 5 for row in cuts)


@given(st.integers(1, 3), st.integers(1, 5), st.integers(2, 9), st.integers(0, 100))
def test_children_are_complementary(n_subpopulations: int, n_pairs: int, n_genes: int, seed: int):
    shape = (n_subpopulations, n_pairs, n_genes)
    first, second = rng(seed).normal(size=shape), rng(seed + 1).normal(size=shape)
    children = one_point_crossover(rng(seed + 2), first, second, used(n_subpopulations, n_genes))
    assert children.shape == (n_subpopulations, 2 * n_pairs, n_genes)
    one, other = children[:, 0::2], children[:, 1::2]
    from_first = one == first
    assert np.array_equal(np.where(from_first, first, second), one)
    assert np.array_equal(np.where(from_first, second, first), other)
    assert from_first.any(axis=2).all()
    assert not from_first.all(axis=2).any()


def test_a_neuron_that_mates_with_itself_has_its_likeness_for_children():
    parent = rng().normal(size=(2, 3, 5))
    assert np.array_equal(one_point_crossover(rng(), parent, parent, used(2, 5)), np.repeat(parent, 2, axis=1))


def test_only_genes_that_are_read_are_cut_and_changed():
    first, second = all_zeros_and_all_ones(2, 500, 6)
    children = one_point_crossover(rng(), first, second, np.array([3, 6]))
    cuts = (children[:, 0::2] == 0).sum(axis=2)
    assert set(cuts[0]) == {1, 2}
    assert set(cuts[1]) == {1, 2, 3, 4, 5}
    unread = np.zeros((2, 500, 6), np.float32)
    mutate(rng(), unread, np.array([3, 6]), 1.0, 0.3, 10.0)
    assert (unread[0, :, 3:] == 0).all()
    assert (unread[1, :, 3:] != 0).any(axis=0).all()
    assert ((unread != 0).sum(axis=2) == 1).all()


# -- mutation ----------------------------------------------------------------------------------------------------------


def test_truncated_cauchy_redraws_what_lies_beyond_the_limit():
    numbers = truncated_cauchy(rng(), 20_000, 0.3, 1.0)
    assert len(numbers) == 20_000
    assert np.abs(numbers).max() <= 1.0
    assert np.abs(numbers).max() > 0.99
    assert (np.abs(numbers) == 1.0).sum() == 0  # redrawn, not clipped


@pytest.mark.parametrize(("scale", "limit"), [(0.3, 10.0), (2.0, 10.0), (0.3, 0.6)])
def test_truncated_cauchy_has_the_quantiles_of_the_truncated_distribution(scale: float, limit: float):
    numbers = np.sort(truncated_cauchy(rng(), 40_000, scale, limit))
    inside = np.arctan(limit / scale)  # pi times half the mass that is left
    for share in (0.1, 0.25, 0.5, 0.75, 0.9):
        quantile = scale * np.tan(inside * (2 * share - 1))
        empirical = (numbers < quantile).mean()
        assert abs(empirical - share) < 0.01


def test_no_numbers_are_drawn_for_no_mutants():
    assert truncated_cauchy(rng(), 0, 0.3, 10.0).shape == (0,)


@pytest.mark.parametrize("rate", [0.0, 0.4, 1.0])
def test_a_share_of_the_children_mutates_in_one_gene(rate: float):
    children = np.zeros((4, 5000, 6), np.float32)
    mutate(rng(), children, all_genes(children), rate, 0.3, 10.0)
    changed = (children != 0).sum(axis=2)
    assert changed.max() <= 1
    assert abs(changed.mean() - rate) < 0.02


def test_every_gene_is_as_likely_to_mutate():
    children = np.zeros((1, 12_000, 6), np.float32)
    mutate(rng(), children, all_genes(children), 1.0, 0.3, 10.0)
    counts = (children[0] != 0).sum(axis=0)
    assert (abs(counts - 2000) < 200).all()


def test_mutation_adds_to_the_gene_and_stays_within_the_limit():
    children = np.full((1, 5000, 3), 100.0, np.float32)
    mutate(rng(), children, all_genes(children), 1.0, 0.3, 2.0)
    change = (children - 100.0).sum(axis=2)
    assert 1.9 < np.abs(change).max() <= 2.0 + 1e-4
    assert abs(np.median(change)) < 0.02
    assert children.dtype == np.float32


def test_mutation_reaches_children_in_any_layout_of_memory():
    children = np.zeros((6, 50, 4), np.float32).transpose(2, 1, 0)
    mutate(rng(), children, all_genes(children), 1.0, 0.3, 10.0)
    assert ((children != 0).sum(axis=2) == 1).all()
