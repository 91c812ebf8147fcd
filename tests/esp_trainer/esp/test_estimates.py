"""What is kept of neurons over the generations: by hand, and whether it tells them apart better."""

from __future__ import annotations

import numpy as np
import pytest

from esp_trainer.config import EspConfig, SideConfig
from esp_trainer.esp.controller import make_controller
from esp_trainer.esp.estimates import Estimates
from esp_trainer.esp.subpopulations import Subpopulations

INF = float("inf")
NO_CHAMPIONS = np.empty((0, 2, 1, 3, 6), np.float32)


def test_earlier_trials_count_in_part() -> None:
    first = Estimates.none(1, 2).after(np.array([[4.0, 0.0]]), np.array([[2, 0]]), 0.5)
    second = first.after(np.array([[1.0, 3.0]]), np.array([[1, 1]]), 0.5)
    assert second.totals.tolist() == [[3.0, 3.0]]
    assert second.trials.tolist() == [[2.0, 1.0]]


@pytest.mark.parametrize(("prior", "scores"), [(0.0, [[2.0, -INF, -1.0]]), (2.0, [[1.0, 0.0, -0.5]])])
def test_scores_are_means_with_trials_of_mean_fitness_besides(prior: float, scores: list[list[float]]) -> None:
    assert Estimates(np.array([[4.0, 0.0, -2.0]]), np.array([[2.0, 0.0, 2.0]])).scores(prior).tolist() == scores


def test_nothing_is_known_of_those_that_were_replaced() -> None:
    before = Estimates(np.array([[8.0, 4.0], [1.0, 2.0]]), np.array([[2.0, 6.0], [1.0, 3.0]]))
    after = before.without(np.array([[1], [0]]))
    assert after.totals.tolist() == [[8.0, 0.0], [0.0, 2.0]]
    assert after.trials.tolist() == [[2.0, 0.0], [0.0, 3.0]]
    assert before.totals.tolist() == [[8.0, 4.0], [1.0, 2.0]]


def subpopulations(**esp: float) -> Subpopulations:
    config = EspConfig(subpopulation_size=8, n_trials=40, n_episodes=1, hof_mates=0, **esp)  # type: ignore[arg-type]
    controller = make_controller(SideConfig(n_hidden=3), np.array([[0, 1]]), 4)
    return Subpopulations.start(config, controller, 2, np.random.default_rng(0))


def generation(population: Subpopulations, number: int, level: float = 0.0) -> None:
    """Fitness is the first gene of all neurons of an agent, plus noise and a level that others set."""
    generator = np.random.default_rng(number)
    teams = population.ask(generator)
    genes = population.genomes[..., 0]
    chosen = np.take_along_axis(genes, teams.indices.transpose(1, 2, 3, 0).astype(int), axis=-1)
    noise = generator.normal(0, 20, (len(teams.indices), len(genes)))
    population.tell(chosen.sum(axis=(1, 2)).T + noise + level, NO_CHAMPIONS, generator)


def test_how_well_others_do_in_a_generation_does_not_matter() -> None:
    even, uneven = subpopulations(memory=0.5, prior_trials=3), subpopulations(memory=0.5, prior_trials=3)
    for number in range(5):
        generation(even, number)
        generation(uneven, number, level=1000.0 * number)
    assert (even.genomes == uneven.genomes).all()
    np.testing.assert_allclose(even.estimates.totals, uneven.estimates.totals, atol=1e-9)


def test_memory_raises_the_share_of_the_scores_that_is_no_noise() -> None:
    """Effects with a variance of 1, noise of 100 in 20 trials: 1 / 6 of the variance of means is theirs. After ten
    generations with a memory of 0.8 the noise is 100 x 54.9 / 89.3 ** 2, and they are 1 / 1.69.
    """
    generator, estimates = np.random.default_rng(0), Estimates.none(2000, 20)
    effects = generator.normal(0, 1, (2000, 20))
    shares = []
    for _ in range(10):
        totals = 20 * effects + generator.normal(0, np.sqrt(20 * 100), effects.shape)
        estimates = estimates.after(totals, np.full(effects.shape, 20), 0.8)
        shares.append(np.corrcoef(estimates.scores(100.0).ravel(), effects.ravel())[0, 1] ** 2)
    assert shares[0] == pytest.approx(1 / 6, abs=0.01)
    assert shares[-1] == pytest.approx(1 / 1.69, abs=0.01)


def test_children_are_scored_by_their_own_trials() -> None:
    population = subpopulations(memory=0.8)
    before = population.genomes.reshape(6, 8, -1).copy()
    generation(population, 0)
    new = (population.genomes.reshape(6, 8, -1) != before).any(axis=2)
    assert new.any()
    assert not population.estimates.trials[new].any()
    assert population.estimates.trials.sum() > 0


def test_a_burst_forgets() -> None:
    population = subpopulations(memory=0.8)
    generation(population, 0)
    assert population.estimates.trials.any()
    population.burst(NO_CHAMPIONS.sum(axis=0), np.random.default_rng(0))
    assert not population.estimates.trials.any()
