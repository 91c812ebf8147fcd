"""Trials in shards on a Ray cluster of one node, by workers that err and die: the bytes of one machine."""

from __future__ import annotations

import os
import re
import signal
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from esp_trainer import cluster
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.evaluation.sharded import ShardedEvaluator
from esp_trainer.presets import preset
from esp_trainer.run.directory import RunDirectory
from esp_trainer.run.trainer import Trainer
from esp_trainer.sweep.on_cluster import ClusterPool
from esp_trainer.sweep.pool import Work
from predprey_env import __version__

if TYPE_CHECKING:
    from collections.abc import Callable

    from esp_trainer.config import RunConfig
    from esp_trainer.types import TrialBatch, TrialResult

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("two_workers")]

PAPER = preset("paper-3v2")
SCRIPTED = PAPER.replace(prey=PAPER.prey.replace(policy="flee_nearest"))


def as_bytes(result: TrialResult) -> list[Any]:
    return [(array.dtype, array.shape, array.tobytes()) for array in (result.fitness, result.captured, result.steps)]


def test_shards_of_any_number_add_up_to_the_batch(random_batch: Callable[..., TrialBatch]) -> None:
    for config in (PAPER, SCRIPTED):
        for n_trials in (1, 16, 17, 100):
            batch = random_batch(config, n_trials, 2)
            expected = as_bytes(FusedEvaluator(config.env, threads=1).evaluate(batch))
            for shards in (1, 2, 3, 50):
                evaluator = ShardedEvaluator(config.env, shards, least_episodes=1)
                assert as_bytes(evaluator.evaluate(batch)) == expected


def test_a_run_has_the_bytes_of_one_machine_with_one_worker(config: RunConfig, tmp_path: Path, snapshot: Any) -> None:
    whole = Trainer.start(RunDirectory(tmp_path / "whole"), config, lambda c: FusedEvaluator(c.env, threads=1))
    list(whole.generations())
    # Every batch in seven shards, the smallest of one block.
    sharded = Trainer.start(
        RunDirectory(tmp_path / "sharded"), config, lambda c: ShardedEvaluator(c.env, 7, least_episodes=1)
    )
    list(sharded.generations())
    assert snapshot(tmp_path / "sharded") == snapshot(tmp_path / "whole")


def test_what_is_wrong_with_a_batch_is_said_as_on_one_machine(random_batch: Callable[..., TrialBatch]) -> None:
    batch = random_batch(PAPER, 64, 1)
    batch.starts[40, 0, 0, 0] = PAPER.env.size
    with pytest.raises(ValueError, match=r"^starts must lie in \[0, 100\), got 0 to 100$"):
        ShardedEvaluator(PAPER.env, 2, least_episodes=1).evaluate(batch)


def test_a_node_with_another_version_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "_versions", lambda: {"predprey-esp": "9.9.9", "numpy": np.__version__})
    versions = rf"^node .* has predprey-esp {re.escape(__version__)}, .*; the driver has predprey-esp 9\.9\.9"
    with pytest.raises(ValueError, match=versions):
        cluster.gather([cluster.submit(abs, -1)])


def test_a_worker_that_is_killed_costs_only_its_shard(
    processes: Any, play_and: Any, random_batch: Callable[..., TrialBatch]
) -> None:
    killed: list[int] = []

    def kill(at_work: list[int]) -> None:
        killed.append(at_work[0])
        os.kill(killed[0], signal.SIGKILL)

    batch = random_batch(PAPER, 6_000, 6)
    result = play_and(kill, batch, processes.at_work)
    assert not processes.title(killed[0])
    assert as_bytes(result) == as_bytes(FusedEvaluator(PAPER.env).evaluate(batch))


def test_what_kills_every_worker_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "RETRIES", 1)
    with pytest.raises(ConnectionError, match=r"^the Ray cluster lost a task: The worker died") as raised:
        cluster.gather([cluster.submit(os._exit, 3)])
    assert "\n" not in str(raised.value)


def test_a_node_that_does_not_see_the_directory_says_so() -> None:
    pool = ClusterPool([Work(Path("/not-shared/sweep/run"), PAPER)])
    (outcome,) = pool.outcomes(60.0)
    assert outcome.reason is not None
    assert outcome.reason.endswith(
        " does not see /not-shared/sweep: the runs of a sweep need a directory that all nodes share"
    )
