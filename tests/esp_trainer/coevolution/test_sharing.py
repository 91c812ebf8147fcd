"""Competitive fitness sharing, by hand after Rosin & Belew, and in a run."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from esp_trainer.coevolution.coevolution import Coevolution
from esp_trainer.coevolution.generation import Generation
from esp_trainer.coevolution.sharing import share_fitness
from esp_trainer.coevolution.sides import new_sides
from esp_trainer.config import ChampionConfig, EspConfig, RunConfig, SideConfig
from esp_trainer.esp.controller import make_controller
from esp_trainer.esp.subpopulations import Subpopulations
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.types import EvolvedTeams, ScriptedTeams
from predprey_env import EnvConfig

CONTROLLER = make_controller(SideConfig(n_hidden=2), np.array([[0, 1]]), 4)


def opponents(indices: Any, size: int = 10) -> EvolvedTeams:
    """Teams of two agents, each of half of the neurons: ``indices (n_trials, n_neurons)``."""
    chosen = np.asarray(indices)
    chosen = chosen.reshape(len(chosen), 2, 1, -1)
    return EvolvedTeams(CONTROLLER, np.zeros((*chosen.shape[1:], size, CONTROLLER.n_genes), np.float32), chosen)


def whole(teams: list[int]) -> EvolvedTeams:
    """Team ``k`` is of the neurons ``k`` alone."""
    return opponents(np.repeat(np.array(teams)[:, None], 4, axis=1))


def column(*fitness: float) -> np.ndarray:
    return np.array(fitness)[:, None]


# -- whole teams that are met again, as Rosin & Belew have it ----------------------------------------------------------


def test_those_who_beat_an_opponent_share_what_it_is_worth():
    """Opponent 3 is beaten twice, 5 once and 7 never: a win is worth a half, one and nothing."""
    shared = share_fitness(column(1, 1, 0, 0, 1, 0), whole([3, 3, 3, 5, 5, 7]))
    np.testing.assert_allclose(shared, column(0.5, 0.5, 0, 0, 1, 0), rtol=1e-12)


def test_a_win_that_nobody_else_has_is_worth_more_than_two_that_all_have():
    """Player A beats 1 and 2 as B and C do, and player D beats 3 alone; each is in three trials."""
    fitness = column(*[1, 1, 0] * 3, *[0, 0, 1])
    shared = share_fitness(fitness, whole([1, 2, 3] * 4)).reshape(4, 3).mean(axis=1)
    assert fitness.reshape(4, 3).mean(axis=1).argmax() == 0
    np.testing.assert_allclose(shared, [2 / 9, 2 / 9, 2 / 9, 1 / 3], rtol=1e-12)


@given(st.lists(st.tuples(st.integers(0, 4), st.integers(0, 100)), min_size=1, max_size=30))
def test_against_whole_teams_each_gets_its_part_of_the_total(trials: list[tuple[int, int]]):
    met, earned = [team for team, _ in trials], np.array([score for _, score in trials], float)
    shared = share_fitness(earned[:, None], whole(met))[:, 0]
    for team in set(met):
        own = np.array(met) == team
        total = earned[own].sum()
        np.testing.assert_allclose(shared[own], earned[own] / total if total else 0.0, rtol=1e-9)


# -- teams that are drawn of neurons -----------------------------------------------------------------------------------


def test_an_opponent_is_worth_the_mean_of_its_neurons():
    """Trials 0 and 1 share the first neuron, 0 and 2 the second, and the other two are each trial's own."""
    shared = share_fitness(column(2, 6, 3), opponents([[1, 1, 1, 1], [1, 2, 2, 2], [3, 1, 3, 3]]))
    worths = [
        (1 / 8 + 1 / 5 + 1 / 2 + 1 / 2) / 4,
        (1 / 8 + 1 / 6 + 1 / 6 + 1 / 6) / 4,
        (1 / 3 + 1 / 5 + 1 / 3 + 1 / 3) / 4,
    ]
    np.testing.assert_allclose(shared[:, 0], np.array([2, 6, 3]) * worths, rtol=1e-12)


def test_neurons_of_the_same_number_in_other_places_are_other_neurons():
    shared = share_fitness(column(1, 1), opponents([[0, 1, 2, 3], [1, 2, 3, 0]], size=4))
    assert shared.tolist() == [[1.0], [1.0]]


@given(st.sampled_from([5, 8, 10]), st.sampled_from([4, 40]), st.integers(0, 1000))
def test_the_worth_of_drawn_teams_equals_a_plain_loop(size: int, n_neurons: int, seed: int):
    generator = np.random.default_rng(seed)
    met, earned = generator.integers(0, size, (20, n_neurons)), generator.integers(0, 5, 20).astype(float)
    shared = share_fitness(earned[:, None], opponents(met, size))[:, 0]
    for trial, team in enumerate(met):
        totals = [earned[met[:, place] == neuron].sum() for place, neuron in enumerate(team)]
        worth = np.mean([1 / total if total else 0.0 for total in totals])
        np.testing.assert_allclose(shared[trial], earned[trial] * worth, rtol=1e-12)


def test_agents_keep_their_parts_of_what_their_team_earned():
    """What a team earned is the mean of its agents: 2 and 4 against the same opponent."""
    shared = share_fitness(np.array([[1.0, 3.0], [4.0, 4.0]]), whole([6, 6]))
    np.testing.assert_allclose(shared, [[1 / 6, 3 / 6], [4 / 6, 4 / 6]], rtol=1e-12)


def test_losses_count_as_nothing():
    """An environment of one's own may pay less than 0."""
    fitness = np.array([[-3.0, 5.0], [-1.0, -1.0], [2.0, 3.0]])
    before = fitness.copy()
    shared = share_fitness(fitness, whole([6, 6, 6]))
    np.testing.assert_allclose(shared, [[0, 1], [0, 0], [0.4, 0.6]], rtol=1e-12)
    assert np.array_equal(fitness, before)


def test_opponents_whom_nobody_beats_are_worth_nothing():
    assert share_fitness(column(0, 0, -5), whole([1, 1, 2])).tolist() == [[0], [0], [0]]


# -- where there is nothing to share -----------------------------------------------------------------------------------


def test_against_a_script_fitness_is_what_it_was():
    fitness = np.array([[-3.0, 5.0], [0.5, 1e9]])
    assert np.array_equal(share_fitness(fitness, ScriptedTeams("flee_nearest")), fitness)


@given(arrays(float, st.tuples(st.integers(1, 20), st.integers(1, 3)), elements=st.integers(0, 1000)))
def test_against_one_team_in_all_trials_everything_is_in_proportion(fitness: np.ndarray):
    shared = share_fitness(fitness, whole([4] * len(fitness)))
    np.testing.assert_allclose(shared * fitness.mean(axis=1).sum(), fitness, rtol=1e-9)


# -- in a run ----------------------------------------------------------------------------------------------------------


def small(**esp: Any) -> RunConfig:
    return RunConfig(
        env=EnvConfig(size=6, max_cycles=12),
        predators=SideConfig(n_hidden=3),
        prey=SideConfig(n_hidden=3, controller="combiner"),
        esp=EspConfig(**{"subpopulation_size": 12, "n_trials": 40, "n_episodes": 2, "hof_mates": 1, **esp}),
        champion=ChampionConfig(n_candidates=3, n_held_out=16),
    )


def evolve(config: RunConfig, n: int, threads: int = 1) -> tuple[Coevolution, list[Generation]]:
    run = Coevolution(config, new_sides(config), FusedEvaluator(config.env, threads))
    return run, [run.step(number) for number in range(n)]


def genomes(run: Coevolution) -> dict[str, bytes]:
    return {role: side.algorithm.genomes.tobytes() for role, side in run.evolving.items()}


@pytest.mark.parametrize("pairing", ["cosample", "mixed"])
def test_sharing_changes_whom_a_generation_breeds_from_but_not_how_it_is_recorded(pairing: str):
    (plain, (own,)), (shared, (theirs,)) = (
        evolve(small(pairing=pairing, fitness_sharing=sharing), 1) for sharing in (False, True)
    )
    assert own.held_out == theirs.held_out
    for role in ("predators", "prey"):
        assert np.array_equal(own.trials[role].fitness, theirs.trials[role].fitness)
        assert np.array_equal(own.champions[role].genomes, theirs.champions[role].genomes)
        assert own.champions[role].score == theirs.champions[role].score
        assert genomes(plain)[role] != genomes(shared)[role]


@pytest.mark.parametrize("pairing", ["cosample", "previous_champion", "hall_of_fame", "mixed"])
def test_each_side_is_told_its_share_of_what_was_earned_against_those_it_met(
    pairing: str, monkeypatch: pytest.MonkeyPatch
):
    config = small(pairing=pairing, fitness_sharing=True)
    run = Coevolution(config, new_sides(config), FusedEvaluator(config.env, 1))
    run.step(0)
    told: list[np.ndarray] = []
    tell = Subpopulations.tell
    monkeypatch.setattr(
        Subpopulations, "tell", lambda self, fitness, *rest: (told.append(fitness), tell(self, fitness, *rest))[1]
    )
    generation = run.step(1)
    for trials, earned in zip(generation.trials.values(), told, strict=True):
        assert np.array_equal(trials.earned, earned)
        if pairing == "previous_champion":
            np.testing.assert_allclose(earned * trials.fitness.mean(axis=1).sum(), trials.fitness)


def test_against_a_script_sharing_changes_nothing():
    runs = [
        evolve(small(fitness_sharing=sharing).replace(prey=SideConfig(policy="flee_nearest")), 4)[0]
        for sharing in (False, True)
    ]
    assert genomes(runs[0]) == genomes(runs[1])


def test_the_same_seed_gives_the_same_bytes_with_any_number_of_threads():
    config = small(pairing="mixed", fitness_sharing=True, n_trials=100)
    assert genomes(evolve(config, 4, 1)[0]) == genomes(evolve(config, 4, 2)[0])
