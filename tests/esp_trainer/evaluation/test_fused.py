"""The compiled evaluator by itself: trials do not touch each other, however they are spread over lanes and threads."""

from __future__ import annotations

import copy as copy_module
import os
import pickle
from copy import deepcopy
from dataclasses import replace
from multiprocessing import get_context
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from waiting import PATIENCE

from esp_trainer.config import RunConfig, SideConfig
from esp_trainer.esp.controller import make_controller
from esp_trainer.evaluation import fused
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.evaluation.sharded import ShardedEvaluator
from esp_trainer.types import EvolvedTeams, ScriptedTeams, TeamBatch, Trace, TrialBatch, TrialResult
from predprey_env import EnvConfig

if TYPE_CHECKING:
    from collections.abc import Callable

ENV = EnvConfig(size=6, max_cycles=20)
CONFIG = RunConfig(env=ENV)


def of_trials(batch: TrialBatch, trials: Any) -> TrialBatch:
    def chosen(teams: TeamBatch) -> TeamBatch:
        return teams if isinstance(teams, ScriptedTeams) else replace(teams, indices=teams.indices[trials])

    return TrialBatch(chosen(batch.predators), chosen(batch.prey), batch.starts[trials])


def as_bytes(result: TrialResult | Trace) -> list[bytes]:
    arrays = result if isinstance(result, tuple) else vars(result).values()
    return [array.tobytes() for array in arrays if array is not None]  # there are no payoffs of another game


def who_always_choose(action: int, n_actions: int, n_agents: int) -> EvolvedTeams:
    """A trial's team whose agents take the same action at every step."""
    controller = make_controller(SideConfig(n_hidden=1), np.array([[0, 1]]), n_actions)
    genes = np.concatenate([[0.0, 0.0], np.eye(n_actions)[action]]).astype(np.float32)
    genomes = np.tile(genes, (n_agents, 1, 1, 1, 1))
    return EvolvedTeams(controller, genomes, np.zeros((1, n_agents, 1, 1), np.int64))


# -- an episode by hand ----------------------------------------------------------------------------------------------


def test_a_prey_that_runs_into_an_idle_predator_ends_the_episode():
    """The prey at x = 0 runs east towards a predator at x = 3, which another at x = 7 of 10 watches."""
    env = EnvConfig(n_predators=2, n_prey=1, size=10, max_cycles=8)
    predators = who_always_choose(4, n_actions=5, n_agents=2)
    prey = who_always_choose(0, n_actions=4, n_agents=1)
    starts = np.array([[[[3, 0], [7, 5], [0, 0]], [[3, 1], [7, 5], [0, 0]]]], np.int32)
    evaluator = FusedEvaluator(env, threads=1)
    batch = TrialBatch(predators, prey, starts)
    result = evaluator.evaluate(batch)
    assert result.steps.tolist() == [[3, 8]]
    assert result.captured.tolist() == [[[True], [False]]]
    # Free, the prey ends at (8, 0): distances 5 + 1 and 1 + 5 of at most 10, so d = 1 - 6 / 10, and 20 d / 1 = 8.
    np.testing.assert_allclose(result.fitness, [[[25, 25, 12.5 * 3 / 8], [8, 8, 25]]], atol=1e-12)
    trace = evaluator.play(batch)[1].cells
    assert trace.shape == (1, 2, 9, 3, 2)
    assert trace[0, 0, :4, 2].tolist() == [[0, 0], [1, 0], [2, 0], [3, 0]]
    assert (trace[0, 0, 4:] == -1).all()
    assert trace[0, 1, :, 2, 0].tolist() == list(range(9))
    assert (trace[0, :, :4, :2] == starts[0, :, None, :2]).all()


@pytest.mark.parametrize(("axis", "ahead", "back"), [(0, 0, 1), (1, 2, 3)])
@pytest.mark.parametrize("distance", [4, -4])
def test_networks_see_on_which_side_their_opponent_is(axis: int, ahead: int, back: int, distance: int):
    """A predator whose two hidden neurons wake on either side of it goes to meet a prey that comes."""
    env = EnvConfig(n_predators=1, n_prey=1, size=20, max_cycles=10)
    genes = np.zeros((1, 1, 2, 1, 2 + 5), np.float32)
    genes[0, 0, :, 0, axis] = [5, -5]
    genes[0, 0, [0, 1], 0, [2 + ahead, 2 + back]] = 1
    controller = make_controller(SideConfig(n_hidden=2, output="linear"), np.array([[0, 1]]), 5)
    predators = EvolvedTeams(controller, genes, np.zeros((1, 1, 1, 2), np.int64))
    prey = who_always_choose(back if distance > 0 else ahead, n_actions=4, n_agents=1)
    starts = np.full((1, 1, 2, 2), 10, np.int32)
    starts[0, 0, 1, axis] += distance
    assert FusedEvaluator(env).evaluate(TrialBatch(predators, prey, starts)).steps.tolist() == [[2]]


@pytest.mark.slow  # another number of actions is compiled for
def test_on_an_even_torus_a_predator_that_never_idles_cannot_catch_a_prey_at_an_odd_distance(
    random_batch: Callable[..., TrialBatch],
):
    for size, caught_ever in ((6, False), (7, True)):
        config = RunConfig(env=EnvConfig(n_predators=1, n_prey=1, size=size, max_cycles=60, predator_idle=False))
        batch = random_batch(config, 400)
        evaluator = FusedEvaluator(config.env)
        odd = np.flatnonzero(evaluator.starts.even_predators(batch.starts)[:, 0, 0] == 0)
        assert evaluator.evaluate(of_trials(batch, odd)).captured.any() == caught_ever


# -- independence ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("n_trials", [1, 15, 16, 17, 100])
def test_results_do_not_depend_on_the_number_of_threads(n_trials: int, random_batch: Callable[..., TrialBatch]):
    batch = random_batch(CONFIG, n_trials, 3)
    results = [as_bytes(FusedEvaluator(ENV, threads).evaluate(batch)) for threads in (1, 2, 7)]
    assert results[0] == results[1] == results[2]


@pytest.mark.parametrize("parts", [1, 3, 100])
def test_results_do_not_depend_on_the_parts_that_threads_take(
    parts: int, random_batch: Callable[..., TrialBatch], monkeypatch: pytest.MonkeyPatch
):
    batch = random_batch(CONFIG, 200, 2)
    expected = as_bytes(FusedEvaluator(ENV, threads=1).evaluate(batch))
    monkeypatch.setattr(fused, "_PARTS_PER_THREAD", parts)
    assert as_bytes(FusedEvaluator(ENV, threads=2).evaluate(batch)) == expected


def test_results_and_traces_do_not_depend_on_how_large_parts_may_be(
    random_batch: Callable[..., TrialBatch], monkeypatch: pytest.MonkeyPatch
):
    batch = random_batch(CONFIG, 100, 2)
    result, trace = FusedEvaluator(ENV, threads=1).play(batch)
    monkeypatch.setattr(fused, "_MOST_BLOCKS", 2)
    for threads in (1, 2):
        again, trace_again = FusedEvaluator(ENV, threads).play(batch)
        assert as_bytes(again) == as_bytes(result)
        assert as_bytes(trace_again) == as_bytes(trace)


def test_traces_do_not_depend_on_the_number_of_threads(random_batch: Callable[..., TrialBatch]):
    batch = random_batch(CONFIG, 90, 2)
    traces = [as_bytes(FusedEvaluator(ENV, threads).play(batch)[1]) for threads in (1, 2, 7)]
    assert traces[0] == traces[1] == traces[2]


def test_a_trial_plays_the_same_whoever_is_in_the_other_lanes(random_batch: Callable[..., TrialBatch]):
    batch = random_batch(CONFIG, 50, 3)
    evaluator = FusedEvaluator(ENV, threads=1)
    whole = evaluator.evaluate(batch)
    assert len(np.unique(whole.steps.sum(axis=1)[:16])) > 5  # lanes end at different times
    for trials in (np.arange(50)[::-1], np.arange(7, 40), np.array([49]), np.array([3, 3, 3, 0, 21] * 4)):
        some = evaluator.evaluate(of_trials(batch, trials))
        assert some.fitness.tobytes() == whole.fitness[trials].tobytes()
        assert some.captured.tobytes() == whole.captured[trials].tobytes()
        assert some.steps.tobytes() == whole.steps[trials].tobytes()


def test_an_episode_plays_the_same_whatever_came_before_it(random_batch: Callable[..., TrialBatch]):
    batch = random_batch(CONFIG, 40, 4)
    evaluator = FusedEvaluator(ENV, threads=1)
    whole = evaluator.evaluate(batch)
    turned = evaluator.evaluate(replace(batch, starts=batch.starts[:, ::-1]))
    assert turned.fitness[:, ::-1].tobytes() == whole.fitness.tobytes()
    for episode in range(4):
        alone = evaluator.evaluate(replace(batch, starts=batch.starts[:, [episode]]))
        assert alone.fitness[:, 0].tobytes() == whole.fitness[:, episode].tobytes()


def test_playing_again_gives_the_same(random_batch: Callable[..., TrialBatch]):
    batch = random_batch(CONFIG, 40, 2)
    evaluator = FusedEvaluator(ENV)
    assert as_bytes(evaluator.evaluate(batch)) == as_bytes(evaluator.evaluate(batch))


def test_tracing_does_not_change_the_game(random_batch: Callable[..., TrialBatch]):
    batch = random_batch(CONFIG, 40, 2)
    evaluator = FusedEvaluator(ENV)
    result, (cells, actions, caught_at) = evaluator.play(batch)
    assert as_bytes(result) == as_bytes(evaluator.evaluate(batch))
    assert np.array_equal((cells[..., 0, 0] >= 0).sum(axis=-1) - 1, result.steps)
    assert np.array_equal(cells[:, :, 0], batch.starts)
    assert np.array_equal((actions[..., 0] >= 0).sum(axis=-1), result.steps)
    assert np.array_equal(caught_at > 0, result.captured)


def test_a_batch_is_left_as_it_is(random_batch: Callable[..., TrialBatch]):
    batch = random_batch(CONFIG, 20, 2)
    parts = [batch.predators.genomes, batch.predators.indices, batch.prey.genomes, batch.prey.indices, batch.starts]
    before = [part.copy() for part in parts]
    FusedEvaluator(ENV).evaluate(batch)
    assert all(np.array_equal(old, new) for old, new in zip(before, parts, strict=True))


# -- what may be handed in -------------------------------------------------------------------------------------------


def test_arrays_of_any_layout_are_played(random_batch: Callable[..., TrialBatch]):
    batch = random_batch(CONFIG, 20, 2)
    expected = as_bytes(FusedEvaluator(ENV).evaluate(batch))
    starts = np.asfortranarray(batch.starts.astype(np.int64))
    starts.flags.writeable = False
    genomes = np.asfortranarray(batch.prey.genomes.astype(np.float64))
    prey = EvolvedTeams(batch.prey.controller, genomes, batch.prey.indices.astype(np.int32))
    assert as_bytes(FusedEvaluator(ENV).evaluate(TrialBatch(batch.predators, prey, starts))) == expected


def test_no_trials_have_no_results(random_batch: Callable[..., TrialBatch]):
    result = FusedEvaluator(ENV).evaluate(of_trials(random_batch(CONFIG, 3, 2), slice(0, 0)))
    assert result.fitness.shape == (0, 2, 5)
    assert result.captured.shape == (0, 2, 2)
    assert result.steps.shape == (0, 2)


def test_results_have_a_row_for_each_episode_of_each_trial(random_batch: Callable[..., TrialBatch]):
    result = FusedEvaluator(ENV).evaluate(random_batch(CONFIG, 9, 4))
    assert (result.fitness.shape, result.fitness.dtype) == ((9, 4, 5), np.float64)
    assert (result.captured.shape, result.captured.dtype) == ((9, 4, 2), np.bool_)
    assert result.steps.shape == (9, 4)
    assert result.steps.min() >= 1
    assert result.steps.max() == ENV.max_cycles


def test_an_evaluator_can_be_compiled_ahead():
    FusedEvaluator(ENV).compile()


@pytest.mark.parametrize("shape", [(8, 2, 4, 2), (8, 2, 5, 3), (8, 2, 5)])
def test_starts_of_another_shape_are_refused(shape: tuple[int, ...], random_batch: Callable[..., TrialBatch]):
    batch = replace(random_batch(CONFIG, 8), starts=np.zeros(shape, np.int32))
    with pytest.raises(ValueError, match=r"starts must have shape \(trials, episodes, 5, 2\), got"):
        FusedEvaluator(ENV).evaluate(batch)


def test_teams_for_another_number_of_trials_agents_or_actions_are_refused(random_batch: Callable[..., TrialBatch]):
    batch = random_batch(CONFIG, 8)
    fewer = of_trials(batch, slice(0, 7))
    for wrong in (
        replace(batch, predators=fewer.predators),
        replace(batch, predators=batch.prey),
        replace(batch, prey=batch.predators),
        random_batch(CONFIG.replace(env=ENV.replace(n_prey=3)), 8),
        random_batch(CONFIG.replace(env=ENV.replace(predator_idle=False)), 8),
    ):
        with pytest.raises(ValueError, match=r"(teams|starts) must have"):
            FusedEvaluator(ENV).evaluate(wrong)


def test_networks_wired_to_more_opponents_than_there_are_are_refused(random_batch: Callable[..., TrialBatch]):
    """The plain evaluator refuses them too; in compiled code they would read what another agent saw."""
    batch = random_batch(CONFIG, 8)
    alone = EnvConfig(size=6, max_cycles=20, n_prey=1)
    prey = replace(batch.prey, genomes=batch.prey.genomes[:1], indices=batch.prey.indices[:, :1])
    with pytest.raises(ValueError, match="networks must read entries below 2, got 3"):
        FusedEvaluator(alone).evaluate(TrialBatch(batch.predators, prey, batch.starts[:, :, :4]))


@pytest.mark.parametrize("cell", [-1, 6, 1000])
def test_starts_outside_the_torus_are_refused(cell: int, random_batch: Callable[..., TrialBatch]):
    """As the environment does."""
    batch = random_batch(CONFIG, 8)
    batch.starts[3, 0, 1, 0] = cell
    with pytest.raises(ValueError, match=r"starts must lie in \[0, 6\)"):
        FusedEvaluator(ENV).evaluate(batch)


# -- copies and forks ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("used", [False, True])
@pytest.mark.parametrize("copy", [deepcopy, copy_module.copy, lambda each: pickle.loads(pickle.dumps(each))])
def test_a_copy_of_an_evaluator_plays_the_same(copy: Any, used: bool, threads: int, random_batch: Any):
    batch, evaluator = random_batch(CONFIG, 40), FusedEvaluator(ENV, threads)
    if used:
        evaluator.evaluate(batch)
    again = copy(evaluator)
    assert again.threads == threads
    assert as_bytes(again.evaluate(batch)) == as_bytes(evaluator.evaluate(batch))


def test_a_sharded_evaluator_can_be_copied(random_batch: Any):
    batch, evaluator = random_batch(CONFIG, 40), ShardedEvaluator(ENV, shards=2, threads=2)
    assert as_bytes(deepcopy(evaluator).evaluate(batch)) == as_bytes(evaluator.evaluate(batch))


@pytest.mark.skipif(not hasattr(os, "fork"), reason="Windows cannot fork")
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork:DeprecationWarning")
def test_a_forked_process_plays_the_same_with_threads_of_its_own(random_batch: Any):
    batch, evaluator = random_batch(CONFIG, 40), FusedEvaluator(ENV, threads=2)
    before = as_bytes(evaluator.evaluate(batch))
    with get_context("fork").Pool(1) as pool:
        assert as_bytes(pool.apply_async(evaluator.evaluate, [batch]).get(timeout=PATIENCE)) == before
    child = os.fork()  # not pickled on the way
    if child == 0:
        os._exit(as_bytes(evaluator.evaluate(batch)) != before)
    assert os.waitpid(child, 0)[1] == 0
    assert as_bytes(evaluator.evaluate(batch)) == before
