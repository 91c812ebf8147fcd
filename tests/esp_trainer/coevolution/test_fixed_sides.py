"""A side that evolves against a team that does not any more."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from small_runs import small

from esp_trainer.coevolution.coevolution import Coevolution
from esp_trainer.coevolution.generation import Generation
from esp_trainer.coevolution.sides import EvolvingSide, new_sides, side_controller
from esp_trainer.config import ChampionConfig, RunConfig
from esp_trainer.esp.team import Team, gather_genomes
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.types import ROLES, EvolvedTeams, Role, ScriptedTeams, TrialBatch, TrialResult
from predprey_env import EnvConfig

OTHER: dict[Role, Role] = {"predators": "prey", "prey": "predators"}
ROLE = pytest.mark.parametrize("fixed", ROLES)


def frozen(config: RunConfig, role: Role, seed: int = 7) -> Team:
    """A team of random networks."""
    side, controller = getattr(config, role), side_controller(config, role)
    shape = (config.env.team(role).n_agents // controller.n_together, *controller.shape)
    genomes = np.random.default_rng(seed).uniform(-6, 6, shape).astype(np.float32)
    return Team(role, side, controller, genomes)


class Spy(FusedEvaluator):
    """Plays, and remembers its batches."""

    def __init__(self, env: EnvConfig, threads: int | None = 1) -> None:
        super().__init__(env, threads)
        self.batches: list[TrialBatch] = []
        self.results: list[TrialResult] = []

    def evaluate(self, batch: TrialBatch) -> TrialResult:
        self.batches.append(batch)
        self.results.append(super().evaluate(batch))
        return self.results[-1]


def evolve(
    config: RunConfig, opponent: Any, role: Role, n: int, evaluator: FusedEvaluator
) -> tuple[Coevolution, list[Generation]]:
    """Generations in which one side is fixed."""
    sides = new_sides(config)
    sides[role] = opponent
    run = Coevolution(config, sides, evaluator)
    return run, [run.step(number) for number in range(n)]


@ROLE
@pytest.mark.parametrize("kind", ["split", "combiner", "central"])
def test_a_fixed_team_plays_in_every_episode_and_never_changes(fixed: Role, kind: str):
    config = small(kind)
    team, evaluator = frozen(config, fixed), Spy(config.env)
    before = team.genomes.copy()
    run, generations = evolve(config, team, fixed, 3, evaluator)
    assert list(run.evolving) == [OTHER[fixed]]
    assert list(run.fixed) == [fixed]
    assert run.sides[fixed] is team
    assert np.array_equal(team.genomes, before)
    assert len(evaluator.batches) == 3 * 3  # trials, champions, held-out
    for batch in evaluator.batches:
        teams = getattr(batch, fixed)
        assert (gather_genomes(teams, np.arange(len(batch.starts))) == before).all()
    for generation in generations:
        assert list(generation.trials) == list(generation.champions) == [OTHER[fixed]]


@ROLE
def test_the_other_side_is_scored_against_it_and_bred(fixed: Role):
    config = small()
    evaluator = Spy(config.env)
    role = OTHER[fixed]
    run, generations = evolve(config, frozen(config, fixed), fixed, 3, evaluator)
    start = new_sides(config)[role]
    assert isinstance(start, EvolvingSide)
    assert not np.array_equal(run.evolving[role].algorithm.genomes, start.algorithm.genomes)
    assert len(run.evolving[role].hall_of_fame) == 3
    for number, generation in enumerate(generations):
        own = slice(0, 3) if role == "predators" else slice(3, 5)
        result = evaluator.results[3 * number]
        assert np.array_equal(generation.trials[role].fitness, result.fitness[..., own].mean(axis=1))
        assert generation.trials[role].payoff == result.captured.mean()


@ROLE
@pytest.mark.parametrize("method", ["reevaluate", "argmax"])
def test_starts_and_contenders_are_those_that_a_script_would_meet(fixed: Role, method: str):
    config = small().replace(champion=ChampionConfig(method=method, n_candidates=3, n_episodes=2, n_held_out=16))
    batches = {}
    for name, opponent in (("team", frozen(config, fixed)), ("script", ScriptedTeams("random"))):
        evaluator = Spy(config.env)
        evolve(config, opponent, fixed, 2, evaluator)
        batches[name] = evaluator.batches
    assert len(batches["team"]) == len(batches["script"])
    for one, other in zip(batches["team"], batches["script"], strict=True):
        assert np.array_equal(one.starts, other.starts)
    first = [getattr(batches[name][0], OTHER[fixed]).indices for name in batches]
    assert np.array_equal(first[0], first[1])


@ROLE
def test_the_champion_is_the_contender_that_does_best_against_it(fixed: Role):
    """Each of the three best of the trials meets it in as many episodes as it would meet contenders."""
    config = small().replace(champion=ChampionConfig(n_candidates=3, n_episodes=2, n_held_out=16))
    evaluator = Spy(config.env)
    role = OTHER[fixed]
    _, generations = evolve(config, frozen(config, fixed), fixed, 2, evaluator)
    for number, generation in enumerate(generations):
        batch, result = evaluator.batches[3 * number + 1], evaluator.results[3 * number + 1]
        assert batch.starts.shape[:2] == (3, 3 * 2)
        contenders = gather_genomes(getattr(batch, role), np.arange(3))
        scores = result.fitness_of(role).mean(axis=(1, 2))
        champion = generation.champions[role]
        assert champion.score == scores.max()
        assert np.array_equal(champion.genomes, contenders[scores.argmax()])


@ROLE
def test_the_champion_meets_it_in_the_held_out_episodes(fixed: Role):
    config = small()
    team, evaluator = frozen(config, fixed), Spy(config.env)
    _, (generation,) = evolve(config, team, fixed, 1, evaluator)
    champion = generation.champions[OTHER[fixed]].as_teams(16)
    teams: dict[Role, EvolvedTeams] = {fixed: team.as_teams(16), OTHER[fixed]: champion}
    starts = evaluator.batches[2].starts
    assert starts.shape[:2] == (16, 1)
    again = FusedEvaluator(config.env, 1).evaluate(TrialBatch(teams["predators"], teams["prey"], starts))
    assert generation.held_out.episodes == 16
    assert generation.held_out.caught.rate == pytest.approx(again.captured.mean())


@ROLE
@pytest.mark.parametrize("pairing", ["previous_champion", "hall_of_fame", "mixed"])
def test_against_a_fixed_team_all_pairings_are_the_same(fixed: Role, pairing: str):
    genomes = []
    for each in ("cosample", pairing):
        config = small(pairing=each)
        run, _ = evolve(config, frozen(config, fixed), fixed, 3, FusedEvaluator(config.env, 1))
        genomes.append(run.evolving[OTHER[fixed]].algorithm.genomes.tobytes())
    assert genomes[0] == genomes[1]


@ROLE
def test_sharing_what_is_earned_against_one_team_divides_all_by_one_number(fixed: Role):
    """So that no rank changes, but that rounding may decide between equals."""
    config = small(fitness_sharing=True)
    team = frozen(config, fixed)
    _, generations = evolve(config, team, fixed, 2, FusedEvaluator(config.env, 1))
    for generation in generations:
        trials = generation.trials[OTHER[fixed]]
        np.testing.assert_allclose(trials.earned * trials.fitness.mean(axis=1).sum(), trials.fitness, rtol=1e-9)


@ROLE
@pytest.mark.parametrize("kind", ["split", "central"])
def test_the_same_seed_gives_the_same_bytes_with_one_and_two_threads(fixed: Role, kind: str):
    config = small(kind, n_trials=100)
    runs = []
    for threads in (1, 2):
        run, generations = evolve(config, frozen(config, fixed), fixed, 4, FusedEvaluator(config.env, threads))
        side = run.evolving[OTHER[fixed]]
        kept: list[Any] = [side.algorithm.genomes.tobytes(), side.hall_of_fame.champions.tobytes()]
        runs.append(kept + [generation.held_out for generation in generations])
    assert runs[0] == runs[1]


@ROLE
def test_other_fixed_teams_bring_other_runs(fixed: Role):
    config = small()
    genomes = set()
    for seed in range(3):
        run, _ = evolve(config, frozen(config, fixed, seed), fixed, 2, FusedEvaluator(config.env, 1))
        genomes.add(run.evolving[OTHER[fixed]].algorithm.genomes.tobytes())
    assert len(genomes) == 3


def test_a_champion_of_one_run_can_be_the_fixed_side_of_another():
    config = small()
    run = Coevolution(config, new_sides(config), FusedEvaluator(config.env, 1))
    champion = run.step(0).champions["prey"]
    kept = champion.genomes.copy()
    evaluator = Spy(config.env)
    evolve(config, champion, "prey", 2, evaluator)
    assert np.array_equal(champion.genomes, kept)
    assert all((gather_genomes(batch.prey, np.arange(len(batch.starts))) == kept).all() for batch in evaluator.batches)


def test_a_fixed_team_learns_nothing_but_who_meets_it_does(fake_evaluator: Any):
    """Fitness is higher the nearer all genes are to 2."""

    def score(predators: np.ndarray, prey: np.ndarray, starts: np.ndarray) -> np.ndarray:
        own = [-((genomes - 2) ** 2).mean(axis=(2, 3, 4)) for genomes in (predators, prey)]
        return np.repeat(np.concatenate(own, axis=1)[:, None], starts.shape[1], axis=1)

    config = small(subpopulation_size=40, n_trials=200, n_episodes=1)
    team = frozen(config, "prey")
    _, generations = evolve(config, team, "prey", 20, fake_evaluator(score))
    means = [generation.trials["predators"].fitness.mean() for generation in generations]
    assert means[-1] > means[10] > means[0]
    assert all(list(generation.trials) == ["predators"] for generation in generations)
