"""Opponents of each side in a generation: sampled together, past champions, exploiters, scripts."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from small_runs import PAIRINGS, Spy, evolve, small

from esp_trainer.coevolution.generation import Generation
from esp_trainer.config import ChampionConfig, SideConfig
from esp_trainer.esp.team import as_candidates, in_every_trial
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.seeding import stream
from esp_trainer.types import ScriptedTeams, TrialBatch


def replayed(batch: TrialBatch, teams: dict[str, Any]) -> TrialBatch:
    """A batch again, with the teams that it had before they were bred from."""

    def again(role: str) -> Any:
        side = getattr(batch, role)
        n = len(side.indices)
        indices = np.broadcast_to(np.arange(n)[:, None, None, None], side.indices.shape)
        return replace(side, genomes=as_candidates(teams[role]), indices=indices)

    return TrialBatch(again("predators"), again("prey"), batch.starts)


def test_cosampled_teams_meet_in_one_batch_that_scores_both():
    config = small()
    evaluator = Spy(config.env)
    _, generations = evolve(config, 2, evaluator)
    assert len(evaluator.batches) == 2 * 3  # trials, champions, held-out
    for number, generation in enumerate(generations):
        batch = evaluator.batches[3 * number]
        assert batch.starts.shape[:2] == (40, 2)
        result = FusedEvaluator(config.env).evaluate(replayed(batch, evaluator.teams[3 * number]))
        assert np.array_equal(generation.trials["predators"].fitness, result.fitness[..., :3].mean(axis=1))
        assert np.array_equal(generation.trials["prey"].fitness, result.fitness[..., 3:].mean(axis=1))
        assert generation.trials["prey"].payoff == result.captured.mean()


@pytest.mark.parametrize("choice", ["latest", "uniform"])
def test_against_past_champions_alone_each_side_has_trials_of_its_own(choice: str):
    config = small(past_share=1.0, past_choice=choice)
    evaluator = Spy(config.env)
    _, generations = evolve(config, 3, evaluator)
    assert len(evaluator.batches) == 3 + 4 + 4
    for first, number in ((3, 1), (7, 2)):
        own, others = evaluator.batches[first], evaluator.batches[first + 1]
        assert np.array_equal(own.starts, others.starts)
        for batch, opponents in ((first, "prey"), (first + 1, "predators")):
            famous = are_champions(evaluator.teams[batch][opponents], generations[:number], opponents)
            assert famous[:, -1].all() if choice == "latest" else famous.any(axis=1).all() and famous.any(axis=0).all()


def are_champions(teams: np.ndarray, generations: list[Generation], role: str) -> np.ndarray:
    """Which team is the champion of which generation, bool ``(n_teams, n_generations)``."""
    champions = [generation.champions[role].genomes for generation in generations]  # type: ignore[index]
    return np.array([[np.array_equal(team, champion) for champion in champions] for team in teams])


@pytest.mark.parametrize("each_episode", [False, True])
def test_a_share_of_every_trial_is_against_past_champions_and_the_rest_scores_both_sides(each_episode: bool):
    config = small(n_episodes=3, past_share=2 / 3, past_each_episode=each_episode)
    evaluator = Spy(config.env)
    _, generations = evolve(config, 3, evaluator)
    assert len(evaluator.batches) == 3 + 5 + 5
    together, *own = evaluator.batches[8:11]
    assert together.starts.shape[:2] == (40, 1)
    expected = (80, 1) if each_episode else (40, 2)
    assert [batch.starts.shape[:2] for batch in own] == [expected, expected]
    assert np.array_equal(own[0].starts, own[1].starts)
    both = FusedEvaluator(config.env).evaluate(replayed(together, evaluator.teams[8]))
    for batch, role, opponents in ((9, "predators", "prey"), (10, "prey", "predators")):
        famous = are_champions(evaluator.teams[batch][opponents], generations[:2], opponents)
        assert famous.any(axis=1).all()
        assert famous.any(axis=0).all()
        past = FusedEvaluator(config.env).evaluate(replayed(evaluator.batches[batch], evaluator.teams[batch]))
        apart = past.fitness_of(role).reshape(40, 2, -1)
        fitness = np.concatenate([both.fitness_of(role), apart], axis=1).mean(axis=1)
        np.testing.assert_allclose(generations[2].trials[role].fitness, fitness)


@pytest.mark.parametrize("policies", [{}, {"prey": "flee_nearest"}])
def test_candidates_meet_past_champions_where_both_sides_evolve(policies: dict[str, Any]):
    config = small().replace(champion=ChampionConfig(n_candidates=3, n_held_out=16, n_past=5))
    config = config.replace(**{role: SideConfig(policy=policy) for role, policy in policies.items()})
    evaluator = Spy(config.env)
    _, generations = evolve(config, 3, evaluator)
    assert len(evaluator.batches) == 3 * 3 + (0 if policies else 2 * 2)
    if not policies:
        for batch, opponents in ((10, "prey"), (11, "predators")):
            famous = are_champions(evaluator.teams[batch][opponents], generations[:2], opponents)
            assert famous.shape == (15, 2)
            assert famous.any(axis=1).all()


def test_every_so_often_each_pool_gets_an_exploiter_of_the_others_champion():
    config = small(past_share=0.5, exploiters_every=2, exploiter_generations=3)
    run, generations = evolve(config, 4)
    assert [list(generation.exploited) for generation in generations] == [[], ["predators", "prey"]] * 2
    assert all("exploiters" in generation.seconds for generation in generations)
    evaluator = FusedEvaluator(config.env, threads=1)
    for role, against in (("predators", "prey"), ("prey", "predators")):
        fame = run.evolving[role].hall_of_fame
        assert (len(fame.guests), len(fame.champions)) == (2, 4)
        for guest, generation in zip(fame.guests, generations[1::2], strict=True):
            assert guest.shape == generation.champions[role].genomes.shape
            assert not np.array_equal(guest, generation.champions[role].genomes)
        opponent = generations[3].champions[against]
        mine = in_every_trial(generations[3].champions[role].controller, fame.guests[1], 16)
        theirs = opponent.as_teams(16)
        teams = (mine, theirs) if role == "predators" else (theirs, mine)
        seed = int(stream(config.seed, f"{role} exploiter", 3).integers(2**63))
        held_out = evaluator.starts.held_out(stream(seed, "held-out"), 16)
        result = evaluator.evaluate(TrialBatch(*teams, held_out))
        assert result.captured.mean() == pytest.approx(generations[3].exploited[role])


def test_a_side_that_meets_a_script_gets_no_exploiter():
    config = small(past_share=0.5, exploiters_every=1).replace(prey=SideConfig(policy="flee_nearest"))
    run, generations = evolve(config, 2)
    assert not any(generation.exploited for generation in generations)
    assert not len(run.evolving["predators"].hall_of_fame.guests)


def test_a_champion_is_remembered_to_win_as_far_as_it_won():
    config = small(n_episodes=2, past_share=0.5)
    evaluator = Spy(config.env)
    run, _ = evolve(config, 2, evaluator)
    assert run.evolving["prey"].hall_of_fame.met[:, 1].tolist() == [40, 0]
    caught = FusedEvaluator(config.env).evaluate(replayed(evaluator.batches[4], evaluator.teams[4])).captured.mean()
    assert run.evolving["prey"].hall_of_fame.met[0, 0] == pytest.approx(40 * (1 - caught))
    caught = FusedEvaluator(config.env).evaluate(replayed(evaluator.batches[5], evaluator.teams[5])).captured.mean()
    assert run.evolving["predators"].hall_of_fame.met[0, 0] == pytest.approx(40 * caught)


def test_the_trials_of_a_block_have_the_same_starts_and_past_champions():
    config = small(n_episodes=2, past_share=0.5, block_size=16)
    evaluator = Spy(config.env)
    evolve(config, 3, evaluator)
    for number in (8, 9, 10):
        starts = evaluator.batches[number].starts
        assert all((block == block[0]).all() for block in (starts[:16], starts[16:32], starts[32:]))
        assert (starts[0] != starts[16]).any()
        assert (starts[16] != starts[32]).any()
    for number, role in ((9, "prey"), (10, "predators")):
        opponents = evaluator.teams[number][role]
        assert all((block == block[0]).all() for block in (opponents[:16], opponents[16:32], opponents[32:]))


def test_a_side_is_scored_only_by_its_own_trials():
    config = small(pairing="previous_champion")
    evaluator = Spy(config.env)
    _, generations = evolve(config, 2, evaluator)
    for batch, role, own in ((3, "predators", slice(0, 3)), (4, "prey", slice(3, 5))):
        result = FusedEvaluator(config.env).evaluate(replayed(evaluator.batches[batch], evaluator.teams[batch]))
        assert np.array_equal(generations[1].trials[role].fitness, result.fitness[..., own].mean(axis=1))


@pytest.mark.parametrize("pairing", PAIRINGS)
@pytest.mark.parametrize(
    ("evolving", "policies"),
    [("predators", {"prey": "flee_nearest"}), ("prey", {"predators": "greedy_chase"})],
)
def test_a_script_stands_in_for_a_side_in_every_batch(pairing: str, evolving: str, policies: dict[str, Any]):
    config = small(pairing=pairing)
    config = config.replace(**{role: SideConfig(policy=policy) for role, policy in policies.items()})
    evaluator = Spy(config.env)
    _, generations = evolve(config, 2, evaluator)
    assert len(evaluator.batches) == 2 * 3
    scripted = next(iter(policies))
    assert all(getattr(batch, scripted) == ScriptedTeams(policies[scripted]) for batch in evaluator.batches)
    for generation in generations:
        assert list(generation.trials) == list(generation.champions) == [evolving]
