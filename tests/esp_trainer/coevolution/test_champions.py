"""Who is champion, with an evaluator that reads the scores from the genomes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from esp_trainer.coevolution.champions import Champion, Contenders, best_teams, choose_champions
from esp_trainer.config import ChampionConfig, SideConfig
from esp_trainer.esp.controller import make_controller
from esp_trainer.esp.team import as_candidates
from esp_trainer.types import EvolvedTeams, ScriptedTeams
from predprey_env.agents import other_team

CONTROLLER = make_controller(SideConfig(n_hidden=2), np.array([[0, 1]]), 4)
PREDATORS, PREY = 3, 2
RNG = np.random.default_rng


def numbered(n_teams: int, n_agents: int) -> Contenders:
    """Teams whose genes are their numbers; the trials liked the first best."""
    genomes = np.arange(n_teams, dtype=np.float32)[:, None, None, None, None] * np.ones((n_agents, 1, 2, 6), np.float32)
    return Contenders(CONTROLLER, genomes, -np.arange(n_teams, dtype=float), 100 + np.arange(n_teams))


def number_of(genomes: np.ndarray | None) -> np.ndarray:
    return np.zeros(1, int) if genomes is None else genomes[:, 0, 0, 0, 0].astype(int)


def scores_by(table: Any) -> Any:
    """Fitness of a meeting by the numbers of both teams: the predators' from the table, the prey's minus that."""
    table = np.asarray(table, float)

    def score(predators: np.ndarray, prey: np.ndarray, starts: np.ndarray) -> np.ndarray:
        own = np.broadcast_to(table[number_of(predators), number_of(prey)], len(starts))
        sides = [own] * PREDATORS + [-own] * PREY
        return np.repeat(np.stack(sides, axis=-1)[:, None], starts.shape[1], axis=1)

    return score


# -- the best of the trials --------------------------------------------------------------------------------------------


def trials() -> EvolvedTeams:
    genomes = np.broadcast_to(np.arange(9, dtype=np.float32)[:, None], (PREY, 1, 2, 9, 6)).copy()
    indices = np.broadcast_to(np.arange(5)[:, None, None, None], (5, PREY, 1, 2))
    return EvolvedTeams(CONTROLLER, genomes, indices)


def test_the_best_teams_have_the_highest_mean_over_their_agents():
    fitness = np.array([[1.0, 1.0], [9.0, 0.0], [4.0, 4.0], [2.0, 8.0], [0.0, 0.0]])
    best = best_teams(trials(), fitness, 3)
    assert number_of(best.genomes).tolist() == [3, 1, 2]
    assert best.scores.tolist() == [5.0, 4.5, 4.0]
    assert best.genomes.shape == (3, PREY, 1, 2, 6)


def test_of_equal_teams_the_earlier_trial_comes_first():
    best = best_teams(trials(), np.ones((5, PREY)), 3)
    assert number_of(best.genomes).tolist() == [0, 1, 2]


def test_fewer_trials_than_candidates_are_all_contenders():
    assert len(best_teams(trials(), np.ones((5, PREY)), 20).scores) == 5


def test_contenders_do_not_change_when_their_subpopulations_are_bred():
    teams = trials()
    best = best_teams(teams, np.ones((5, PREY)), 2)
    teams.genomes[:] = -1
    assert number_of(best.genomes).tolist() == [0, 1]


# -- argmax ------------------------------------------------------------------------------------------------------------


def test_argmax_trusts_the_trials_and_plays_nothing(fake_evaluator: Any):
    evaluator = fake_evaluator(scores_by(np.zeros((4, 4))))
    contenders = {"predators": numbered(4, PREDATORS), "prey": numbered(4, PREY)}
    champions = choose_champions(contenders, ChampionConfig(method="argmax"), evaluator, RNG(0))
    assert not evaluator.batches
    for role in ("predators", "prey"):
        assert (champions[role].genomes == 0).all()
        assert champions[role].score == 0.0


# -- reevaluate ----------------------------------------------------------------------------------------------------

# Predators 1 have the best mean, 12 / 4; prey 2 do, with -3 / 3. The trials liked neither best.
TABLE = [[5, 1, 0, 4], [3, 3, 2, 4], [0, 9, 1, 1]]


def test_every_contender_meets_every_other_once(fake_evaluator: Any):
    evaluator = fake_evaluator(scores_by(TABLE))
    contenders = {"predators": numbered(3, PREDATORS), "prey": numbered(4, PREY)}
    choose_champions(contenders, ChampionConfig(n_episodes=5), evaluator, RNG(0))
    assert len(evaluator.batches) == 1
    met = zip(number_of(evaluator.genomes[0]["predators"]), number_of(evaluator.genomes[0]["prey"]), strict=True)
    assert sorted(met) == [(i, j) for i in range(3) for j in range(4)]
    assert evaluator.batches[0].starts.shape == (12, 5)
    assert len(np.unique(evaluator.batches[0].starts)) == 60  # fresh starts for each meeting


def test_the_best_mean_over_all_meetings_wins(fake_evaluator: Any):
    evaluator = fake_evaluator(scores_by(TABLE))
    contenders = {"predators": numbered(3, PREDATORS), "prey": numbered(4, PREY)}
    champions = choose_champions(contenders, ChampionConfig(), evaluator, RNG(0))
    assert (champions["predators"].genomes == 1).all()
    assert champions["predators"].score == 3.0
    assert champions["predators"].genomes.shape == (PREDATORS, 1, 2, 6)
    assert (champions["prey"].genomes == 2).all()
    assert champions["prey"].score == -1.0
    assert champions["prey"].genomes.shape == (PREY, 1, 2, 6)


def test_scores_are_means_over_agents_and_episodes(fake_evaluator: Any):
    def score(predators: np.ndarray, prey: np.ndarray, starts: np.ndarray) -> np.ndarray:
        return np.tile([[1.0, 2.0, 6.0, 10.0, 20.0], [3.0, 4.0, 8.0, 30.0, 40.0]], (len(starts), 1, 1))

    contenders = {"predators": numbered(2, PREDATORS), "prey": numbered(2, PREY)}
    champions = choose_champions(contenders, ChampionConfig(n_episodes=2), fake_evaluator(score), RNG(0))
    assert champions["predators"].score == 4.0
    assert champions["prey"].score == 25.0


def test_of_equal_means_the_one_that_the_trials_liked_better_wins(fake_evaluator: Any):
    contenders = {"predators": numbered(3, PREDATORS), "prey": numbered(4, PREY)}
    champions = choose_champions(contenders, ChampionConfig(), fake_evaluator(scores_by(np.ones((3, 4)))), RNG(0))
    assert (champions["predators"].genomes == 0).all()
    assert (champions["prey"].genomes == 0).all()


@pytest.mark.parametrize(
    ("contenders", "table", "role", "best", "score"),
    [
        (numbered(3, PREDATORS), [[1], [5], [2]], "predators", 1, 5),
        (numbered(3, PREY), [[4, 6, 2]], "prey", 2, -2),
    ],
)
def test_against_a_script_only_the_evolving_side_has_a_champion(
    contenders: Contenders, table: Any, role: str, best: int, score: float, fake_evaluator: Any
):
    evaluator = fake_evaluator(scores_by(table))
    fixed = {other_team(role): ScriptedTeams("random")}
    config = ChampionConfig(n_candidates=3, n_episodes=2)
    champions = choose_champions({role: contenders}, config, evaluator, RNG(0), fixed=fixed)
    assert list(champions) == [role]
    assert (champions[role].genomes == best).all()
    assert champions[role].score == score
    assert evaluator.batches[0].starts.shape == (3, 6), "as many episodes as against three contenders"


def test_past_champions_that_all_contenders_meet_count_as_much_as_contenders_do(fake_evaluator: Any):
    evaluator = fake_evaluator(scores_by(TABLE))
    contenders = {"predators": numbered(3, PREDATORS), "prey": numbered(4, PREY)}
    past = {
        "predators": EvolvedTeams(CONTROLLER, as_candidates(numbered(2, PREY).genomes), np.full((3, PREY, 1, 2), 1))
    }
    champions = choose_champions(contenders, ChampionConfig(n_episodes=5), evaluator, RNG(0), past)
    assert (champions["predators"].genomes == 2).all()
    assert champions["predators"].score == pytest.approx((0 + 9 + 1 + 1 + 3 * 9) / 7)
    assert (champions["prey"].genomes == 2).all(), "nobody else changes"
    assert len(evaluator.batches) == 2
    starts = evaluator.batches[1].starts
    assert starts.shape == (9, 5)
    assert (starts[:3] == starts[3:6]).all()
    assert (starts[:3] == starts[6:]).all()
    assert len(np.unique(starts[:3])) == 15


def test_a_champion_can_play_every_trial_of_a_batch(members: Any):
    genomes = np.arange(PREY * 12, dtype=np.float32).reshape(PREY, 1, 2, 6)
    teams = Champion(CONTROLLER, genomes, 1.0, 0).as_teams(4)
    assert (members(teams) == genomes).all()
    assert members(teams).shape == (4, *genomes.shape)
