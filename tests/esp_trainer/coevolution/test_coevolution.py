"""Generations of two sides: who meets whom, what is kept, and that the same seed gives the same bytes."""

from __future__ import annotations

import tracemalloc
from typing import Any

import numpy as np
import pytest
from small_runs import PAIRINGS, Spy, evolve, small

from esp_trainer.coevolution import coevolution as module
from esp_trainer.coevolution.coevolution import Coevolution
from esp_trainer.coevolution.generation import Generation
from esp_trainer.coevolution.sides import new_sides, side_controller
from esp_trainer.config import ChampionConfig, EspConfig, RunConfig, SideConfig
from esp_trainer.evaluation import fused
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.types import ScriptedTeams
from predprey_env import EnvConfig


def everything(run: Coevolution, generations: list[Generation]) -> list[Any]:
    """All that came of a run but its wall time."""
    kept: list[Any] = [(g.number, g.held_out) for g in generations]
    for role, side in run.evolving.items():
        kept += [side.algorithm.genomes.tobytes(), side.hall_of_fame.champions.tobytes(), side.best, side.stagnant]
        kept += [(g.trials[role].fitness.tobytes(), g.trials[role].payoff) for g in generations]
        kept += [(g.champions[role].genomes.tobytes(), g.champions[role].score) for g in generations]
    return kept


# -- the same seed, the same bytes -----------------------------------------------------------------------------------


@pytest.mark.parametrize("pairing", PAIRINGS)
def test_the_same_seed_gives_the_same_bytes_with_any_number_of_threads(pairing: str):
    config = small(pairing=pairing, n_trials=100)
    runs = [everything(*evolve(config, 4, FusedEvaluator(config.env, threads))) for threads in (1, 2, 7)]
    assert runs[0] == runs[1] == runs[2]


def test_the_same_seed_gives_the_same_bytes_however_trials_are_shared_out(monkeypatch: pytest.MonkeyPatch):
    config = small(n_trials=100)
    expected = everything(*evolve(config, 3, FusedEvaluator(config.env, 2)))
    monkeypatch.setattr(fused, "_PARTS_PER_THREAD", 1)
    assert everything(*evolve(config, 3, FusedEvaluator(config.env, 3))) == expected


@pytest.mark.parametrize("size", [12, 300])  # indices of one byte, and of two
def test_the_same_seed_gives_the_same_bytes_however_large_parts_may_be(size: int, monkeypatch: pytest.MonkeyPatch):
    config = small(n_trials=100, pairing="mixed", subpopulation_size=size)
    expected = everything(*evolve(config, 3))
    monkeypatch.setattr(fused, "_MOST_BLOCKS", 1)
    assert everything(*evolve(config, 3)) == expected


def test_memory_grows_by_less_than_a_kilobyte_a_trial():
    def peak(n_trials: int) -> int:
        config = RunConfig(
            env=EnvConfig(size=12, max_cycles=2),
            esp=EspConfig(subpopulation_size=300, n_trials=n_trials),
            champion=ChampionConfig(n_candidates=2, n_held_out=8),
        )
        run = Coevolution(config, new_sides(config), FusedEvaluator(config.env, threads=2))
        tracemalloc.start()
        try:
            run.step(0)
            return tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()

    assert (peak(50_000) - peak(10_000)) / 40_000 < 900


def test_other_seeds_give_other_runs():
    one, other = (everything(*evolve(small().replace(seed=seed), 2)) for seed in (0, 1))
    assert all(a != b for a, b in zip(one[2:4], other[2:4], strict=True))


def test_a_generation_depends_on_the_sides_and_not_on_the_object_that_ran_before():
    config = small(pairing="mixed")
    whole, _ = evolve(config, 5)
    first, _ = evolve(config, 2)
    second = Coevolution(config, first.sides, FusedEvaluator(config.env))
    for number in range(2, 5):
        second.step(number)
    for role, side in whole.evolving.items():
        assert second.evolving[role].algorithm.genomes.tobytes() == side.algorithm.genomes.tobytes()


@pytest.mark.parametrize("pairing", PAIRINGS)
def test_no_stream_of_random_numbers_is_used_twice(pairing: str, monkeypatch: pytest.MonkeyPatch):
    used: list[tuple[int, str, int]] = []

    def stream(seed: int, purpose: str, generation: int = 0) -> np.random.Generator:
        used.append((seed, purpose, generation))
        return original(seed, purpose, generation)

    original = module.stream
    monkeypatch.setattr(module, "stream", stream)
    evolve(small(pairing=pairing), 3)
    assert len(used) == len(set(used))


# -- both sides before the first generation --------------------------------------------------------------------------


def test_new_sides_have_networks_for_their_opponents_and_no_champions():
    config = small().replace(prey=SideConfig(controller="monolithic", n_hidden=7))
    sides = new_sides(config)
    assert sides["predators"].algorithm.genomes.shape == (3, 2, 3, 12, 2 + 5)
    assert sides["prey"].algorithm.genomes.shape == (2, 1, 7, 12, 6 + 4)
    assert all(len(side.hall_of_fame) == 0 for side in sides.values())


def test_predators_that_cannot_idle_have_four_outputs():
    config = small().replace(env=EnvConfig(predator_idle=False))
    assert side_controller(config, "predators").n_actions == 4
    assert side_controller(config, "prey").n_actions == 4


def test_the_two_sides_begin_apart_and_follow_from_the_seed():
    config = small().replace(env=EnvConfig(n_predators=2, n_prey=2, predator_idle=False))
    sides, again = new_sides(config), new_sides(config)
    genes = {role: side.algorithm.genomes for role, side in sides.items()}
    assert not np.array_equal(genes["predators"], genes["prey"])
    assert all(np.array_equal(genes[role], again[role].algorithm.genomes) for role in genes)


def test_a_scripted_side_is_a_script():
    config = small().replace(prey=SideConfig(policy="flee_nearest"))
    assert new_sides(config)["prey"] == ScriptedTeams("flee_nearest")


# -- starts ----------------------------------------------------------------------------------------------------------


def test_every_generation_has_starts_of_its_own_but_the_same_held_out_ones():
    config = small()
    evaluator = Spy(config.env)
    evolve(config, 2, evaluator)
    trials, champions, held_out = (evaluator.batches[k].starts for k in range(3))
    again = [evaluator.batches[3 + k].starts for k in range(3)]
    assert not np.array_equal(trials, again[0])
    assert not np.array_equal(champions, again[1])
    assert np.array_equal(held_out, again[2])
    assert held_out.shape == (16, 1, 5, 2)
    even = evaluator.starts.even_predators(held_out)[:, 0]
    assert [np.bincount(some).tolist() for some in even.T] == [[2, 6, 6, 2]] * 2


def test_the_champions_meet_in_the_held_out_episodes():
    config = small()
    evaluator = Spy(config.env)
    _, generations = evolve(config, 2, evaluator)
    for batch, generation in ((2, generations[0]), (5, generations[1])):
        for role in ("predators", "prey"):
            assert (evaluator.teams[batch][role] == generation.champions[role].genomes).all()
        assert generation.held_out.episodes == 16


# -- champions -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["argmax", "reevaluate"])
def test_the_champion_is_one_of_the_best_trial_teams(method: str):
    config = small().replace(champion=ChampionConfig(method=method, n_candidates=3, n_held_out=16))
    evaluator = Spy(config.env)
    _, generations = evolve(config, 2, evaluator)
    per_generation = 2 if method == "argmax" else 3
    assert len(evaluator.batches) == 2 * per_generation
    for number, generation in enumerate(generations):
        for role, champion in generation.champions.items():
            scores = generation.trials[role].fitness.mean(axis=1)
            best = np.argsort(-scores, kind="stable")[:3]
            teams = evaluator.teams[per_generation * number][role][best]
            places = [k for k, team in enumerate(teams) if np.array_equal(team, champion.genomes)]
            assert places
            if method == "argmax":
                assert places[0] == 0
                assert champion.score == scores.max()


def test_the_hall_of_fame_grows_by_each_generations_champion_and_never_changes():
    config = small(mutation_rate=1.0, hof_mates=3)
    run = Coevolution(config, new_sides(config), FusedEvaluator(config.env))
    kept: dict[str, list[np.ndarray]] = {"predators": [], "prey": []}
    for number in range(6):
        generation = run.step(number)
        for role, side in run.evolving.items():
            kept[role].append(generation.champions[role].genomes.copy())
            assert len(side.hall_of_fame) == number + 1
            assert np.array_equal(side.hall_of_fame.champions, np.array(kept[role]))


def test_a_champion_is_not_altered_by_the_breeding_of_later_generations():
    config = small(mutation_rate=1.0)
    run = Coevolution(config, new_sides(config), FusedEvaluator(config.env))
    generations, before = [], []
    for number in range(5):
        generations.append(run.step(number))
        before.append({role: c.genomes.copy() for role, c in generations[-1].champions.items()})
    for generation, copies in zip(generations, before, strict=True):
        assert all(np.array_equal(generation.champions[role].genomes, copy) for role, copy in copies.items())


def test_hall_of_fame_mates_bring_genes_of_lost_champions_back():
    """A champion of genes that no subpopulation has passes them on."""
    config = small(hof_mates=3, mutation_rate=0.0)
    run = Coevolution(config, new_sides(config), FusedEvaluator(config.env))
    for side in run.evolving.values():
        lost = np.full(side.hall_of_fame.champions.shape[1:], 1000.0, np.float32)
        side.hall_of_fame = side.hall_of_fame.with_champion(lost)
    run.step(0)
    for side in run.evolving.values():
        children = (side.algorithm.genomes == 1000.0).any(axis=-1)
        assert (children.sum(axis=-1) == 6).all()  # both children of the three pairs


# -- evolution -------------------------------------------------------------------------------------------------------


def towards(predators_target: float, prey_target: float) -> Any:
    """Fitness of an agent: minus the mean squared distance of its genes from its side's target."""

    def score(predators: np.ndarray | None, prey: np.ndarray | None, starts: np.ndarray) -> np.ndarray:
        sides = [(predators, predators_target, 3), (prey, prey_target, 2)]
        own = [
            np.zeros((len(starts), n)) if genomes is None else -((genomes - target) ** 2).mean(axis=(2, 3, 4))
            for genomes, target, n in sides
        ]
        return np.repeat(np.concatenate(own, axis=1)[:, None], starts.shape[1], axis=1)

    return score


def test_both_sides_evolve_towards_what_their_own_fitness_rewards(fake_evaluator: Any):
    config = small(subpopulation_size=40, n_trials=200, n_episodes=1, hof_mates=2)
    run, generations = evolve(config, 40, fake_evaluator(towards(2.0, -3.0)))
    for role, target in (("predators", 2.0), ("prey", -3.0)):
        means = [generation.trials[role].fitness.mean() for generation in generations]
        assert means[0] < -10  # variance 12 of the initial genes, and the square of the target
        assert means[-1] > means[20] > means[10] > means[0]
        assert means[-1] > -2
        scores = [generation.champions[role].score for generation in generations]
        assert scores[-1] > -1.5
        genes = run.evolving[role].algorithm.genomes
        assert abs(genes.mean() - target) < 0.3


def test_without_a_fitness_to_follow_nothing_is_learned(fake_evaluator: Any):
    def score(predators: np.ndarray, prey: np.ndarray, starts: np.ndarray) -> np.ndarray:
        return np.zeros((*starts.shape, 5))

    config = small(n_episodes=1, hof_mates=0)
    run, _ = evolve(config, 10, fake_evaluator(score))
    assert abs(run.evolving["prey"].algorithm.genomes.mean()) < 1.5


# -- bursts ----------------------------------------------------------------------------------------------------------


def constant(predators: np.ndarray, prey: np.ndarray, starts: np.ndarray) -> np.ndarray:
    return np.ones((*starts.shape, 5))


def test_a_side_starts_again_around_its_champion_once_none_was_better_for_so_long(fake_evaluator: Any):
    config = small(burst_after=2, n_episodes=1)
    run = Coevolution(config, new_sides(config), fake_evaluator(constant))
    bursts = []
    for number in range(7):
        generation = run.step(number)
        for role, side in run.evolving.items():
            first = side.algorithm.genomes[:, :, :, 0]
            if np.array_equal(first, generation.champions[role].genomes):
                bursts.append((number, role))
    # Generation 0 sets the mark, 1 and 2 do not pass it; after the burst 3 sets another.
    assert bursts == [(2, "predators"), (2, "prey"), (5, "predators"), (5, "prey")]


def test_a_better_champion_puts_a_burst_off(fake_evaluator: Any):
    calls = iter(range(10_000))

    def ever_better(predators: np.ndarray, prey: np.ndarray, starts: np.ndarray) -> np.ndarray:
        return np.full((*starts.shape, 5), float(next(calls)))

    run, _ = evolve(small(burst_after=1, n_episodes=1), 4, fake_evaluator(ever_better))
    assert all(side.stagnant == 0 for side in run.evolving.values())
    assert all(side.best > 0 for side in run.evolving.values())


def test_by_default_there_are_no_bursts(fake_evaluator: Any):
    run, _ = evolve(small(n_episodes=1), 6, fake_evaluator(constant))
    for side in run.evolving.values():
        assert (side.best, side.stagnant) == (1.0, 5)


# -- the record ------------------------------------------------------------------------------------------------------


def test_a_generation_says_how_long_its_phases_took():
    _, (generation,) = evolve(small(), 1)
    assert generation.number == 0
    assert set(generation.seconds) == {"trials", "champions", "held_out", "breeding"}
    assert all(seconds >= 0 for seconds in generation.seconds.values())
