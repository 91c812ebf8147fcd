"""The genetic operators of section V, on many subpopulations at once.

``S`` subpopulations, each of ``P`` neurons with ``G`` genes.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from esp_trainer.arrays import Counts, Fitness, NeuronIndices


def sums_by_neuron(chosen: NeuronIndices, fitness: Fitness, size: int) -> tuple[Fitness, Counts]:
    """Return the summed fitness of the trials that each neuron took part in, and their number: ``(S, size)`` each.

    Args:
        chosen: Index of the neuron of each subpopulation that each trial used, int ``(n_trials, S)``.
        fitness: Fitness of each trial for those subpopulations, ``(n_trials,)``.
        size: Number of neurons in a subpopulation.
    """
    n_subpopulations = chosen.shape[1]
    shape, flat = (n_subpopulations, size), (chosen + size * np.arange(n_subpopulations)).ravel()
    total = np.bincount(flat, np.repeat(fitness, n_subpopulations), n_subpopulations * size)
    times = np.bincount(flat, minlength=n_subpopulations * size)
    return total.reshape(shape), times.reshape(shape)


def ranking(fitness: Fitness) -> NeuronIndices:
    """Return the neurons of each subpopulation from best to worst, int ``(S, P)``; ties go to the lower index."""
    return np.argsort(-fitness, axis=-1, kind="stable")


def draw_mates(
    generator: np.random.Generator, n_subpopulations: int, n_elite: int, mate: Literal["uniform", "better_ranked"]
) -> np.ndarray:
    """Sample the rank of each elite neuron's mate, int ``(S, n_elite)``: any elite, or one that ranks no worse."""
    shape = (n_subpopulations, n_elite)
    if mate == "uniform":
        return generator.integers(0, n_elite, shape)
    return generator.integers(0, np.arange(n_elite) + 1, shape)


def one_point_crossover(
    generator: np.random.Generator, first: np.ndarray, second: np.ndarray, used: Counts
) -> np.ndarray:
    """Return both children of each pair of gene strings, cut at a random place that leaves each parent a gene.

    The parents are two arrays ``(S, n_pairs, G)``. The result is ``(S, 2 * n_pairs, G)``, the children of a pair side
    by side. Only the first ``used`` genes of a subpopulation count, int ``(S,)``.
    """
    return join_at_cuts(first, second, draw_cuts(generator, first.shape[1], used))


def draw_cuts(generator: np.random.Generator, n_pairs: int, used: Counts) -> Counts:
    """Sample where the genes of each pair are cut, int ``(S, n_pairs)``: the number of genes before the cut."""
    return generator.integers(1, used[:, None], (len(used), n_pairs))


def join_at_cuts(first: np.ndarray, second: np.ndarray, cuts: Counts) -> np.ndarray:
    """Return both children of each pair of gene strings, as :func:`one_point_crossover` does, from their cuts."""
    n_subpopulations, n_pairs, n_genes = first.shape
    head = np.arange(n_genes) < cuts[:, :, None]
    children = np.stack([np.where(head, first, second), np.where(head, second, first)], axis=2)
    return children.reshape(n_subpopulations, 2 * n_pairs, n_genes)


def truncated_cauchy(generator: np.random.Generator, n: int, scale: float, limit: float) -> np.ndarray:
    """Sample ``n`` Cauchy-distributed numbers; those beyond the limit are sampled again."""
    numbers = scale * generator.standard_cauchy(n)
    while len(beyond := np.flatnonzero(np.abs(numbers) > limit)):
        numbers[beyond] = scale * generator.standard_cauchy(len(beyond))
    return numbers


def mutate(
    generator: np.random.Generator, children: np.ndarray, used: Counts, rate: float, scale: float, limit: float
) -> None:
    """With probability ``rate``, change one random gene of a child, in place, by a Cauchy-distributed number.

    Only the first ``used`` genes of a subpopulation's children, ``(S, n_children, G)``, count: int ``(S,)``.
    """
    mutants = np.nonzero(generator.random(children.shape[:-1]) < rate)
    genes = generator.integers(0, used[mutants[0]], len(mutants[0]))
    changes = truncated_cauchy(generator, len(genes), scale, limit)
    children[(*mutants, genes)] += changes.astype(children.dtype)
