"""Subpopulations whose gene strings differ in length, and those of agents that are steered together."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from esp_trainer.config import EspConfig, SideConfig
from esp_trainer.esp.controller import make_controller, wiring_for
from esp_trainer.esp.subpopulations import Subpopulations
from esp_trainer.networks.controller import Controller

SIZE = 20


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def esp(**settings: Any) -> EspConfig:
    return EspConfig(**{"subpopulation_size": SIZE, "n_trials": 400, "hof_mates": 0, "mutation_rate": 0.0, **settings})


def made(kind: str, n_opponents: int = 2, n_actions: int = 5, n_agents: int = 3) -> Controller:
    side = SideConfig(controller=kind, n_hidden=3)
    return make_controller(side, wiring_for(side, n_opponents, n_agents), n_actions, n_agents)


COMBINER = made("combiner")
"""Two networks with 2 inputs and one with 10, and 5 outputs each: neurons of 7, 7 and 15 genes."""
USED = (7, 7, 15)
N_AGENTS = 2
CENTRAL = made("central")
"""One network for three agents."""


def used(genomes: np.ndarray) -> np.ndarray:
    """Which genes of genomes ``(..., n_hidden, size, n_genes)`` of the combiner are used."""
    return np.broadcast_to(np.arange(15) < np.array(USED)[:, None, None, None], genomes.shape)


def assert_only_used(genomes: np.ndarray) -> None:
    assert (genomes[~used(genomes)] == 0).all()
    assert (genomes[used(genomes)] != 0).all()


def bred(population: Subpopulations, champions: np.ndarray | None = None, seed: int = 0) -> np.ndarray:
    """The genomes after a generation in which random teams did well."""
    n_trials = len(population.ask(rng(seed)).indices)
    fame = np.empty((0, *population.genomes[:, :, :, 0].shape)) if champions is None else champions
    fitness = rng(seed + 1).random((n_trials, len(population.genomes) * population.controller.n_together))
    population.tell(fitness, fame, rng(seed + 2))
    return population.genomes


# -- gene strings of several lengths -----------------------------------------------------------------------------------


def test_genes_that_no_network_uses_begin_as_zero():
    genomes = Subpopulations.start(esp(init_range=2.0), COMBINER, N_AGENTS, rng()).genomes
    assert genomes.shape == (N_AGENTS, 3, 3, SIZE, 15)
    assert genomes.dtype == np.float32
    assert_only_used(genomes)
    assert np.abs(np.quantile(genomes[used(genomes)], [0.25, 0.5, 0.75]) - [-1, 0, 1]).max() < 0.15


def test_they_stay_zero_through_breeding():
    population = Subpopulations.start(esp(mutation_rate=1.0, hof_mates=2), COMBINER, N_AGENTS, rng())
    champions = rng(9).uniform(1, 2, (3, *population.genomes.shape)) * used(population.genomes)
    before = population.genomes.copy()
    for generation in range(20):
        assert_only_used(bred(population, champions[:, :, :, :, 0], 10 * generation))
    assert (population.genomes != before)[used(before)].mean() > 0.9


def test_they_stay_zero_through_a_burst():
    population = Subpopulations.start(esp(), COMBINER, N_AGENTS, rng())
    champion = population.genomes[:, :, :, 7].copy()
    population.burst(champion, rng(1))
    assert_only_used(population.genomes)
    assert np.array_equal(population.genomes[:, :, :, 0], champion)
    others = population.genomes[:, :, :, 1:]
    moved = (others != champion[:, :, :, None])[used(others)]
    assert moved.mean() > 0.99


def test_parents_are_cut_among_the_genes_that_are_used_and_each_leaves_one():
    """All mates are the champion's, whose genes are 100, so that every child has genes of two parents."""
    population = Subpopulations.start(esp(hof_mates=5), COMBINER, N_AGENTS, rng())
    labels = np.arange(1, SIZE + 1, dtype=np.float32)[:, None] * used(population.genomes)
    champion = (100 * used(population.genomes))[None, :, :, :, 0]
    cuts: dict[int, set[int]] = {network: set() for network in range(3)}
    for seed in range(12):
        population.genomes[:] = labels
        children = bred(population, champion, 100 * seed)
        for network, n_used in enumerate(USED):
            genes = children[:, network, ..., :n_used].reshape(-1, n_used)
            places = [np.flatnonzero(np.diff(child)) + 1 for child in genes if 100 in child]
            assert [len(some) for some in places] == [1] * (N_AGENTS * 3 * SIZE // 2)
            cuts[network] |= set(np.concatenate(places).tolist())
    assert cuts == {network: set(range(1, n_used)) for network, n_used in enumerate(USED)}


def test_a_mutation_changes_a_gene_that_is_used():
    """All neurons are alike, so that children differ from their parents by mutation alone."""
    population = Subpopulations.start(esp(mutation_rate=1.0), COMBINER, N_AGENTS, rng())
    before = np.ascontiguousarray(np.broadcast_to(population.genomes[:, :, :, :1], population.genomes.shape))
    population.genomes[:] = before
    changed = (bred(population) != before).sum(axis=-1)
    assert (np.sort(changed, axis=-1) == [0] * 10 + [1] * 10).all()
    assert_only_used(population.genomes)


# -- agents that are steered together ----------------------------------------------------------------------------------


def test_a_central_team_has_one_genome():
    population = Subpopulations.start(esp(), CENTRAL, 1, rng())
    assert population.genomes.shape == (1, 1, 3, SIZE, 3 * 2 * 2 + 3 * 5)
    assert (population.genomes != 0).all()
    assert population.ask(rng()).indices.shape == (400, 1, 1, 3)


def test_a_central_teams_neurons_earn_the_mean_of_its_agents():
    """Neuron 7 is best for the first agent, 3 for the second and 9 for the last, but 5 for all of them."""
    population = Subpopulations.start(esp(elite_share=0.05), CENTRAL, 1, rng())
    before = population.genomes.copy()
    chosen = population.ask(rng()).indices[:, 0, 0, 0]
    fitness = np.stack([2.0 * (chosen == best) + 1.5 * (chosen == 5) for best in (7, 3, 9)], axis=1)
    population.tell(fitness, np.empty((0, 1, 1, 3, 27)), rng(1))
    first = population.genomes[0, 0, 0]
    alike = {neuron: int((first == before[0, 0, 0, neuron]).all(axis=-1).sum()) for neuron in (3, 5, 7, 9)}
    assert alike == {3: 1, 5: 3, 7: 1, 9: 1}  # the best and its two likenesses


def test_what_one_of_them_loses_counts_as_much_as_what_another_wins():
    population = Subpopulations.start(esp(elite_share=0.05), CENTRAL, 1, rng())
    before = population.genomes.copy()
    chosen = population.ask(rng()).indices[:, 0, 0, 0]
    fitness = np.stack([9.0 * (chosen == 7), -9.0 * (chosen == 7), 1.0 * (chosen == 2)], axis=1)
    population.tell(fitness, np.empty((0, 1, 1, 3, 27)), rng(1))
    assert (population.genomes[0, 0, 0] == before[0, 0, 0, 2]).all(axis=-1).sum() == 3


@pytest.mark.parametrize("shape", [(400,), (400, 1), (400, 2), (399, 3), (400, 3, 1)])
def test_a_central_team_is_told_the_fitness_of_each_of_its_agents(shape: tuple[int, ...]):
    population = Subpopulations.start(esp(), CENTRAL, 1, rng())
    population.ask(rng())
    with pytest.raises(ValueError, match=r"fitness must have shape \(400, 3\), got"):
        population.tell(np.zeros(shape), np.empty((0, 1, 1, 3, 27)), rng())


@pytest.mark.parametrize("kind", ["combiner", "double", "pairs", "central"])
def test_breeding_depends_on_nothing_but_its_generator(kind: str):
    def whole(seed: int) -> bytes:
        population = Subpopulations.start(esp(mutation_rate=0.4), made(kind, 3), 1 if kind == "central" else 3, rng())
        return bred(population, seed=seed).tobytes()

    assert whole(5) == whole(5) != whole(6)


def test_spread_is_that_of_the_genes_that_are_read() -> None:
    # Of each subpopulation half the neurons hold 1 in the genes that are read and half 7: mean 4, deviation 3.
    genomes = np.where(np.arange(SIZE)[:, None] % 2, np.float32(7), np.float32(1)) * np.ones(
        (2, 3, 3, SIZE, 15), np.float32
    )
    genomes[~used(genomes)] = 1000.0
    spread = Subpopulations(esp(), COMBINER, genomes).spread()
    assert spread.diversity == pytest.approx(3.0)
    assert spread.scale == pytest.approx(4.0)
    assert Subpopulations(esp(), COMBINER, -genomes).spread() == spread


def test_neurons_that_are_all_alike_have_no_spread() -> None:
    genomes = np.ones((2, 3, 3, SIZE, 1), np.float32) * np.arange(15, dtype=np.float32)
    assert Subpopulations(esp(), COMBINER, genomes).spread().diversity == 0.0
