"""Ask, tell and breeding, on genes that say where they come from."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from esp_trainer.config import EspConfig, SideConfig
from esp_trainer.esp.controller import make_controller
from esp_trainer.esp.subpopulations import Subpopulations

SIZE = 20
N_ELITE = 5
CONTROLLER = make_controller(SideConfig(n_hidden=3), np.array([[0, 1], [2, 3]]), 4)
N_AGENTS = 2
SHAPE = (N_AGENTS, 2, 3)  # agents, networks, hidden neurons
NO_FAME = np.empty((0, *SHAPE, CONTROLLER.n_genes), np.float32)


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def esp(**settings: Any) -> EspConfig:
    return EspConfig(**{"subpopulation_size": SIZE, "n_trials": 400, "hof_mates": 0, "mutation_rate": 0.0, **settings})


def labelled(first: int = 0) -> np.ndarray:
    """Genomes in which every gene is the number of its neuron, from ``first`` on: 20 to a subpopulation."""
    n_subpopulations = int(np.prod(SHAPE))
    labels = first + np.arange(n_subpopulations * SIZE, dtype=np.float32)
    return np.repeat(labels, CONTROLLER.n_genes).reshape(*SHAPE, SIZE, CONTROLLER.n_genes)


class Drawing:
    """Stands in for the generator of ask(): draws the same given neuron for all subpopulations of a trial."""

    def __init__(self, neurons: list[int]) -> None:
        self.neurons = np.array(neurons)

    def integers(self, low: int, high: int, shape: tuple[int, ...]) -> np.ndarray:
        return np.broadcast_to(self.neurons[:, None, None, None], shape)


def bred(config: EspConfig, champions: np.ndarray = NO_FAME, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Labelled subpopulations before and after a generation in which neuron 0 was the best, then 1, 2, ..."""
    before = labelled()
    population = Subpopulations(config, CONTROLLER, before.copy())
    neurons = np.arange(config.n_trials) % SIZE
    population.ask(Drawing(neurons))
    population.tell(-np.repeat(neurons[:, None], N_AGENTS, axis=1).astype(float), champions, rng(seed))
    return before, population.genomes


# -- ask and tell ----------------------------------------------------------------------------------------------------


def test_random_genes_are_uniform_in_the_initial_range():
    population = Subpopulations.start(esp(init_range=2.0), CONTROLLER, 3, rng())
    genes = population.genomes
    assert genes.shape == (3, 2, 3, SIZE, 6)
    assert genes.dtype == np.float32
    assert np.abs(genes).max() <= 2.0
    assert np.abs(np.quantile(genes, [0.25, 0.5, 0.75]) - [-1, 0, 1]).max() < 0.15


def test_ask_gives_a_neuron_of_each_subpopulation_to_each_trial():
    teams = Subpopulations.start(esp(), CONTROLLER, N_AGENTS, rng()).ask(rng())
    assert teams.indices.shape == (400, *SHAPE)
    assert teams.indices.min() == 0
    assert teams.indices.max() == SIZE - 1
    assert teams.controller is CONTROLLER


def test_teams_are_drawn_uniformly_with_replacement_and_apart_for_each_subpopulation():
    population = Subpopulations.start(esp(n_trials=4000), CONTROLLER, N_AGENTS, rng())
    chosen = population.ask(rng()).indices.reshape(4000, -1)
    for neuron in range(SIZE):
        assert (abs((chosen == neuron).mean(axis=0) - 1 / SIZE) < 0.015).all()
    assert all(len(np.unique(some)) < SIZE for some in chosen[:SIZE].T)  # some came twice before all came once
    assert np.abs(np.corrcoef(chosen.T) - np.eye(12)).max() < 0.1


@pytest.mark.parametrize(("size", "kind"), [(256, np.uint8), (257, np.uint16)])
def test_drawn_teams_are_kept_in_the_smallest_numbers_that_name_all_neurons(size: int, kind: type):
    genomes = np.zeros((*SHAPE, size, CONTROLLER.n_genes), np.float32)
    indices = Subpopulations(esp(subpopulation_size=size), CONTROLLER, genomes).draw(rng(), 2000).indices
    assert indices.dtype == kind
    assert (indices.min(), indices.max()) == (0, size - 1)


def test_asking_again_after_tell_gives_other_teams():
    population = Subpopulations.start(esp(), CONTROLLER, N_AGENTS, rng())
    generator = rng()
    first = population.ask(generator).indices.copy()
    population.tell(np.zeros((400, N_AGENTS)), NO_FAME, rng())
    assert not np.array_equal(first, population.ask(generator).indices)


def test_ask_is_refused_when_called_twice():
    population = Subpopulations.start(esp(), CONTROLLER, N_AGENTS, rng())
    population.ask(rng())
    with pytest.raises(RuntimeError, match=r"ask\(\) was called twice; tell\(\)"):
        population.ask(rng())


def test_tell_is_refused_before_ask_and_when_called_twice():
    population = Subpopulations.start(esp(), CONTROLLER, N_AGENTS, rng())
    with pytest.raises(RuntimeError, match=r"tell\(\) needs the teams of ask\(\)"):
        population.tell(np.zeros((400, N_AGENTS)), NO_FAME, rng())
    population.ask(rng())
    population.tell(np.zeros((400, N_AGENTS)), NO_FAME, rng())
    with pytest.raises(RuntimeError, match=r"tell\(\) needs the teams of ask\(\)"):
        population.tell(np.zeros((400, N_AGENTS)), NO_FAME, rng())


def test_drawn_opponents_are_not_bred_from():
    population = Subpopulations.start(esp(), CONTROLLER, N_AGENTS, rng())
    teams = population.draw(rng(), 7)
    assert teams.indices.shape == (7, *SHAPE)
    with pytest.raises(RuntimeError):
        population.tell(np.zeros((7, N_AGENTS)), NO_FAME, rng())


def test_fitness_that_is_not_finite_is_refused_with_its_place():
    population = Subpopulations.start(esp(), CONTROLLER, N_AGENTS, rng())
    population.ask(rng())
    fitness = np.zeros((400, N_AGENTS))
    fitness[7, 1] = fitness[9, 0] = np.inf
    with pytest.raises(ValueError, match=r"fitness must be finite, got inf for agent 1 in trial 7"):
        population.tell(fitness, NO_FAME, rng())


@pytest.mark.parametrize("shape", [(400,), (400, 1), (399, N_AGENTS), (400, N_AGENTS, 1)])
def test_fitness_of_another_shape_is_refused_and_can_be_told_again(shape: tuple[int, ...]):
    population = Subpopulations.start(esp(), CONTROLLER, N_AGENTS, rng())
    population.ask(rng())
    with pytest.raises(ValueError, match=r"fitness must have shape \(400, 2\), got"):
        population.tell(np.zeros(shape), NO_FAME, rng())
    population.tell(np.zeros((400, N_AGENTS)), NO_FAME, rng())


@pytest.mark.parametrize("shape", [(2, 1, 3, SIZE, 6), (2, 2, 4, SIZE, 6), (2, 2, 3, SIZE + 1, 6), (2, 2, 3, SIZE, 7)])
def test_genomes_of_another_shape_are_refused(shape: tuple[int, ...]):
    with pytest.raises(ValueError, match=r"genomes must have shape \(agents, 2, 3, 20, 6\), got"):
        Subpopulations(esp(), CONTROLLER, np.zeros(shape, np.float32))


# -- who is scored how -------------------------------------------------------------------------------------------------


def test_each_agents_neurons_are_scored_by_its_own_fitness():
    """Agent 0 does best with neuron 7, agent 1 with neuron 3: each keeps its own."""
    population = Subpopulations(esp(elite_share=0.05), CONTROLLER, labelled())
    chosen = population.ask(rng()).indices
    fitness = np.stack([chosen[:, 0, 0, 0] == 7, chosen[:, 1, 1, 2] == 3], axis=1).astype(float)
    population.tell(fitness, NO_FAME, rng(1))
    kept = population.genomes[..., 0]
    for agent, network, hidden, neuron in ((0, 0, 0, 7), (1, 1, 2, 3)):
        label = labelled()[agent, network, hidden, neuron, 0]
        assert (kept[agent, network, hidden] == label).sum() == 3  # itself and its two likenesses


def test_all_neurons_of_all_networks_share_the_agents_fitness():
    """One trial with neuron 5 everywhere, one with neuron 8, and the rest untested."""
    config = esp(n_trials=2, subpopulation_size=4, elite_share=0.25)
    genomes = np.zeros((1, 2, 3, 4, 6), np.float32) + np.arange(4, dtype=np.float32)[:, None]
    population = Subpopulations(config, CONTROLLER, genomes)
    population.ask(Drawing([1, 3]))
    population.tell(np.array([[5.0], [8.0]]), np.empty((0, 1, 2, 3, 6)), rng(1))
    # Best to worst: 3, 1, 0, 2 (untested, in order); the two worst become likenesses of the best.
    assert (population.genomes[..., 0] == [3, 1, 3, 3]).all()


# -- breeding ----------------------------------------------------------------------------------------------------------


def test_children_replace_exactly_the_worse_half_and_the_others_stay():
    before, after = bred(esp())
    assert np.array_equal(after[..., :10, :], before[..., :10, :])
    assert (after[..., 10:, :] != before[..., 10:, :]).all(axis=-1).all()


def test_children_are_made_of_the_elite_of_their_own_subpopulation():
    before, after = bred(esp())
    elite = before[..., :N_ELITE, 0]
    for place in np.ndindex(*SHAPE):
        assert np.isin(after[place][10:], elite[place]).all()


def test_pairs_are_bred_in_rank_order_and_put_in_from_the_bottom_up():
    """The children of pair k, of which the elite neuron k is the first parent, take the places 19 - 2k and 18 - 2k."""
    before, after = bred(esp())
    for pair in range(N_ELITE):
        parent = before[..., pair, 0]
        assert np.array_equal(after[..., SIZE - 1 - 2 * pair, 0], parent)
        assert np.array_equal(after[..., SIZE - 2 - 2 * pair, -1], parent)


def test_the_two_children_of_a_pair_complement_each_other():
    _, after = bred(esp())
    for pair in range(N_ELITE):
        one, other = after[..., SIZE - 1 - 2 * pair, :], after[..., SIZE - 2 - 2 * pair, :]
        both = np.sort(np.stack([one, other]), axis=0)
        assert (both == both[..., :1]).all()  # the same two parents at every gene
        assert ((one != other).all(axis=-1) | (one == other).all(axis=-1)).all()


def test_mates_vary_between_subpopulations():
    _, after = bred(esp())
    mates = after[..., SIZE - 1, -1] - labelled()[..., 0, 0]
    assert len(np.unique(mates)) > 2


def test_better_ranked_mates_make_the_best_neuron_mate_with_itself():
    before, after = bred(esp(mate="better_ranked"))
    assert np.array_equal(after[..., -1, :], before[..., 0, :])
    assert np.array_equal(after[..., -2, :], before[..., 0, :])


def test_the_worst_are_found_by_rank_and_not_by_place():
    """Neuron 19 is the best here and 0 the worst, so children come into places 0 to 9."""
    before = labelled()
    population = Subpopulations(esp(), CONTROLLER, before.copy())
    chosen = population.ask(rng()).indices
    fitness = chosen[:, :, 0, 0].astype(float)
    population.tell(fitness, NO_FAME, rng(1))
    for agent in range(N_AGENTS):
        after = population.genomes[agent, 0, 0]
        assert np.array_equal(after[10:], before[agent, 0, 0, 10:])
        assert np.array_equal(after[[0, 2, 4, 6, 8], 0], before[agent, 0, 0, [19, 18, 17, 16, 15], 0])


def test_only_children_mutate():
    before, after = bred(esp(mutation_rate=1.0, elite_share=0.05))  # an elite of one, so likenesses but for mutations
    assert np.array_equal(after[..., :18, :], before[..., :18, :])
    changed = (after[..., 18:, :] != before[..., :1, :]).sum(axis=-1)
    assert (changed == 1).all()


@given(st.integers(4, 40), st.floats(0.05, 1 / 3), st.integers(0, 50))
def test_the_elite_always_survives_and_twice_as_many_are_replaced(size: int, share: float, seed: int):
    if int(share * size + 1e-9) < 1:
        share = 1 / size + 1e-6
    config = EspConfig(subpopulation_size=size, elite_share=share, n_trials=30, hof_mates=0)
    controller = make_controller(SideConfig(n_hidden=2), np.array([[0, 1]]), 4)
    population = Subpopulations.start(config, controller, 1, rng(seed))
    before = population.genomes.copy()
    chosen = population.ask(rng(seed + 1)).indices
    fitness = rng(seed + 2).random((30, 1))
    population.tell(fitness, np.empty((0, 1, 1, 2, 6)), rng(seed + 3))
    same = (population.genomes == before).all(axis=-1).reshape(2, size)
    assert ((~same).sum(axis=1) <= 2 * config.n_elite).all()
    for hidden in range(2):
        members, index = np.unique(chosen[:, 0, 0, hidden], return_inverse=True)
        means = [fitness[index == k].mean() for k in range(len(members))]
        best = members[np.argsort(means)[::-1][: config.n_elite]]
        assert same[hidden, best].all()


# -- the hall of fame ------------------------------------------------------------------------------------------------


def fame_of(n_champions: int) -> np.ndarray:
    """Champions whose every gene is 10,000 for each champion, plus the number of its place in the team."""
    places = np.arange(np.prod(SHAPE), dtype=np.float32).reshape(SHAPE)
    champions = 10_000 * np.arange(1, n_champions + 1, dtype=np.float32)[:, None, None, None] + places
    return np.repeat(champions[..., None], CONTROLLER.n_genes, axis=-1)


def test_the_last_pairs_mate_with_the_neuron_in_the_same_place_of_a_past_champion():
    _, after = bred(esp(hof_mates=2), fame_of(3))
    mates = np.stack([after[..., SIZE - 1 - 2 * pair, -1] for pair in range(N_ELITE)])
    assert (mates[:3] < 10_000).all()
    places = np.arange(np.prod(SHAPE)).reshape(SHAPE)
    assert (mates[3:] >= 10_000).all()
    assert (mates[3:] % 10_000 == places).all()


def test_past_champions_are_drawn_uniformly_and_apart_for_each_subpopulation():
    drawn = []
    for seed in range(60):
        _, after = bred(esp(hof_mates=5, n_trials=SIZE), fame_of(4), seed)
        drawn.append([after[..., SIZE - 1 - 2 * pair, -1] // 10_000 for pair in range(N_ELITE)])
    counts = np.bincount(np.array(drawn, int).ravel(), minlength=5)
    assert counts[0] == 0
    assert (abs(counts[1:] / counts.sum() - 0.25) < 0.03).all()
    assert len(np.unique(np.array(drawn)[0, 0])) > 1


def test_without_champions_all_mates_are_elite():
    assert (bred(esp(hof_mates=5))[1] < 10_000).all()


def test_champions_are_left_as_they_are():
    champions = fame_of(2)
    before = champions.copy()
    bred(esp(hof_mates=5, mutation_rate=1.0), champions)
    assert np.array_equal(champions, before)


# -- memory ------------------------------------------------------------------------------------------------------------


def told_twice(config: EspConfig) -> Subpopulations:
    """A population whose neuron n earns -n, in 20 trials of each of two generations, and 100 more in the second."""
    population = Subpopulations(config, CONTROLLER, labelled())
    neurons = np.arange(config.n_trials) % SIZE
    for more in (0, 100):
        population.ask(Drawing(neurons))
        population.tell(more - np.repeat(neurons[:, None], N_AGENTS, axis=1).astype(float), NO_FAME, rng())
    return population


OVER_THE_MEAN = 20 * (9.5 - np.arange(SIZE))
"""What the 20 trials of each neuron earn beyond the mean of all, which is -9.5."""
ELDERS = np.arange(SIZE) < SIZE - 2 * N_ELITE
"""The better half, which stays; the others are replaced in each generation."""


def test_earlier_trials_count_in_part_and_not_what_all_neurons_earned_there():
    estimates = told_twice(esp(memory=0.5)).estimates
    np.testing.assert_allclose(estimates.totals, np.tile(np.where(ELDERS, 1.5 * OVER_THE_MEAN, 0), (12, 1)))
    np.testing.assert_array_equal(estimates.trials, np.tile(np.where(ELDERS, 30, 0), (12, 1)))


@pytest.mark.parametrize("prior", [0.5, 3.0])
def test_without_memory_a_prior_counts_the_last_trials_alone(prior: float):
    estimates = told_twice(esp(prior_trials=prior)).estimates
    np.testing.assert_allclose(estimates.totals, np.tile(OVER_THE_MEAN, (12, 1)))
    np.testing.assert_array_equal(estimates.trials, 20)


def test_without_memory_and_prior_nothing_is_remembered():
    estimates = told_twice(esp()).estimates
    assert not estimates.totals.any()
    assert not estimates.trials.any()


def test_what_is_remembered_is_part_of_the_state():
    population, fresh = told_twice(esp(memory=0.5)), Subpopulations(esp(memory=0.5), CONTROLLER, labelled())
    assert set(population.state()) == {"genomes", "totals", "trials"}
    fresh.restore(population.state())
    np.testing.assert_array_equal(fresh.estimates.totals, population.estimates.totals)
    np.testing.assert_array_equal(fresh.estimates.trials, population.estimates.trials)
    assert set(told_twice(esp()).state()) == {"genomes"}
    Subpopulations(esp(), CONTROLLER, labelled()).restore({"genomes": labelled(5)})


def test_parents_are_kept_where_that_is_asked_for():
    population = Subpopulations(esp(hof_mates=2), CONTROLLER, labelled())
    assert told_twice(esp()).parents is None
    population.keeps_parents = True
    population.ask(rng())
    population.tell(rng(1).random((400, N_AGENTS)), NO_FAME, rng(2))
    assert population.parents is not None
    np.testing.assert_array_equal(population.parents.past, np.full((12, 2), -1))


def test_genomes_in_any_layout_of_memory_are_bred():
    population = Subpopulations(esp(), CONTROLLER, np.asfortranarray(labelled()))
    population.ask(rng())
    population.tell(rng(1).random((400, N_AGENTS)), NO_FAME, rng(2))
    assert not np.array_equal(population.genomes, labelled())


# -- burst -------------------------------------------------------------------------------------------------------------


def test_burst_starts_again_around_the_champion_and_keeps_it_as_the_first_neuron():
    population = Subpopulations.start(esp(burst_scale=0.3), CONTROLLER, N_AGENTS, rng())
    champion = rng(1).uniform(-6, 6, (*SHAPE, 6)).astype(np.float32)
    population.burst(champion, rng(2))
    assert np.array_equal(population.genomes[:, :, :, 0], champion)
    spread = population.genomes[:, :, :, 1:] - champion[:, :, :, None]
    assert np.abs(spread).max() <= 10.0 + 1e-5
    assert (spread != 0).all(axis=-1).mean() > 0.99
    assert abs(np.median(np.abs(spread)) - 0.3) < 0.05  # half a Cauchy's mass lies within its scale
    assert population.genomes.dtype == np.float32


def test_burst_spreads_by_its_scale_within_the_limit_of_mutations():
    population = Subpopulations.start(esp(burst_scale=5.0, mutation_limit=2.0), CONTROLLER, N_AGENTS, rng())
    population.burst(np.zeros((*SHAPE, 6), np.float32), rng())
    assert 1.9 < np.abs(population.genomes).max() <= 2.0


# -- randomness --------------------------------------------------------------------------------------------------------


def test_breeding_depends_on_nothing_but_its_generator():
    again = [bred(esp(mutation_rate=0.4, hof_mates=2), fame_of(3), seed)[1].tobytes() for seed in (5, 5, 6)]
    assert again[0] == again[1] != again[2]
