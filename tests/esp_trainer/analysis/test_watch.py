"""Champions of a run, watched: who plays, from where, and what is counted of it."""

from __future__ import annotations

import numpy as np
import pytest

from esp_trainer.analysis.behaviours.counts import BehaviourRate, count_behaviours
from esp_trainer.analysis.behaviours.registry import BEHAVIOURS
from esp_trainer.analysis.history import History
from esp_trainer.analysis.watch import episodes, watch_behaviours
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.evaluation.reference import predprey_reference
from esp_trainer.presets import preset
from esp_trainer.seeding import stream
from esp_trainer.types import TrialBatch

SMOKE = preset("smoke").replace(generations=4)
N = 16


def evolve(**policies: str) -> History:
    config = SMOKE
    for role, policy in policies.items():
        config = config.replace(**{role: getattr(config, role).replace(policy=policy)})
    return History.evolve(config, FusedEvaluator(config.env, threads=1))


HISTORIES = {
    "both evolve": {},
    "scripted prey": {"prey": "flee_nearest"},
    "scripted predators": {"predators": "greedy_chase"},
}


@pytest.fixture(scope="module", params=HISTORIES.values(), ids=HISTORIES)
def history(request: pytest.FixtureRequest) -> History:
    return evolve(**request.param)


@pytest.fixture(scope="module")
def evaluator() -> FusedEvaluator:
    return FusedEvaluator(SMOKE.env, threads=1)


def batch_of(history: History, generation: int, evaluator: FusedEvaluator, seed: int = 0) -> TrialBatch:
    starts = evaluator.starts.held_out(stream(seed, "watched"), N)
    players = (history.player(role, generation).as_teams(N) for role in ("predators", "prey"))
    return TrialBatch(*players, starts)


def test_what_is_played_is_both_what_came_of_it_and_the_trace(history: History, evaluator: FusedEvaluator):
    batch = batch_of(history, 2, evaluator)
    result, trace = evaluator.play(batch)
    alone = evaluator.evaluate(batch)
    for name in ("fitness", "captured", "steps"):
        np.testing.assert_array_equal(getattr(result, name), getattr(alone, name))
    seen = (trace.cells[:, 0, :, 0, 0] >= 0).sum(axis=1)
    np.testing.assert_array_equal(seen, result.steps[:, 0] + 1)  # the start is seen too


def test_episodes_are_the_generations_champions_from_the_same_starts(history: History, evaluator: FusedEvaluator):
    trace, paths = episodes(history, evaluator, 2, n_episodes=N)
    batch = batch_of(history, 2, evaluator)
    expected = predprey_reference(SMOKE.env).evaluate(batch)
    assert trace.shape == (N, 31, 5, 2)
    np.testing.assert_array_equal(trace[:, 0], batch.starts[:, 0])
    np.testing.assert_array_equal(paths.lengths, expected.steps[:, 0])
    assert (paths.n_episodes, paths.n_predators, paths.n_prey) == (N, 3, 2)
    for episode, steps in enumerate(expected.steps[:, 0]):
        assert (trace[episode, : steps + 1] >= 0).all()
        assert (trace[episode, steps + 1 :] == -1).all()


def test_every_behaviour_has_a_rate_in_every_generation(history: History, evaluator: FusedEvaluator):
    found = watch_behaviours(history, evaluator, np.array([3, 0, 1]), n_episodes=N)
    assert list(found) == [*BEHAVIOURS, "specialisation"]
    for name, rates in found.items():
        assert len(rates) == 3
        for each in rates:
            for number in (each.rate, each.null):
                assert np.isnan(number) or -1e-12 < number < 1 + 1e-12, name
            assert 0 <= each.n <= (N if name in BEHAVIOURS else 3 * N)


def content(rates: dict[str, list[BehaviourRate]]) -> dict[str, list[str]]:
    """Equal also where a rate is nan."""
    return {name: [repr(rate) for rate in row] for name, row in rates.items()}


def test_it_follows_from_its_seed(history: History, evaluator: FusedEvaluator):
    found = [content(watch_behaviours(history, evaluator, np.array([0, 3]), n_episodes=N, seed=s)) for s in (1, 1, 2)]
    assert found[0] == found[1]
    assert found[0] != found[2]


def test_a_generation_is_seen_the_same_whoever_else_is_watched(history: History, evaluator: FusedEvaluator):
    both = content(watch_behaviours(history, evaluator, np.array([0, 3]), n_episodes=N))
    last = content(watch_behaviours(history, evaluator, np.array([3]), n_episodes=N))
    assert {name: row[1:] for name, row in both.items()} == last


def test_another_seed_has_other_starts(history: History, evaluator: FusedEvaluator):
    first, second = (episodes(history, evaluator, 0, n_episodes=N, seed=seed)[0] for seed in (1, 2))
    assert (first[:, 0] != second[:, 0]).any()


def test_rates_are_those_of_the_episodes(history: History, evaluator: FusedEvaluator):
    found = watch_behaviours(history, evaluator, np.array([3]), n_episodes=N)
    _, paths = episodes(history, evaluator, 3, n_episodes=N)
    assert content(found) == {n: [repr(r)] for n, r in count_behaviours(paths, stream(0, "null", 3)).items()}
    seen = [name for name, detector in BEHAVIOURS.items() if not np.isnan(detector(paths)).all()]
    assert len(seen) > 8
    for name in seen:
        assert found[name][0].rate == pytest.approx(np.nanmean(BEHAVIOURS[name](paths)))


def test_with_a_single_prey_what_takes_two_is_not_asked(evaluator: FusedEvaluator):
    config = SMOKE.replace(env=SMOKE.env.replace(n_prey=1), generations=1)
    one = FusedEvaluator(config.env, threads=1)
    found = watch_behaviours(History.evolve(config, one), one, np.array([0]), n_episodes=N)
    for name in ("herding", "scattering", "simultaneous capture"):
        assert np.isnan(found[name][0].rate)
        assert found[name][0].n == 0
    assert not np.isnan(found["attacker"][0].rate)
