"""Trials on a Ray cluster: the bytes of one machine with one worker, whatever the shards and the workers."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import ray

from esp_trainer import cluster
from esp_trainer.cli import main
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.evaluation.sharded import ShardedEvaluator
from esp_trainer.presets import preset
from esp_trainer.run.directory import RunDirectory
from esp_trainer.run.trainer import Trainer

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from esp_trainer.config import RunConfig
    from esp_trainer.types import TrialBatch, TrialResult

pytestmark = pytest.mark.slow

PAPER = preset("paper-3v2")
SCRIPTED = PAPER.replace(prey=PAPER.prey.replace(policy="flee_nearest"))


def as_bytes(result: TrialResult) -> list[Any]:
    return [(array.dtype, array.shape, array.tobytes()) for array in (result.fitness, result.captured, result.steps)]


@pytest.mark.parametrize("n_workers", [1, 2, 7])
def test_a_run_has_the_bytes_of_one_machine_with_one_worker(
    n_workers: int, config: RunConfig, workers: Any, tmp_path: Path, snapshot: Any
) -> None:
    whole = Trainer.start(RunDirectory(tmp_path / "whole"), config, lambda c: FusedEvaluator(c.env, threads=1))
    list(whole.generations())
    with workers(n_workers):
        # Every batch in seven shards, the smallest of one block.
        sharded = Trainer.start(
            RunDirectory(tmp_path / "sharded"), config, lambda c: ShardedEvaluator(c.env, 7, least_episodes=1)
        )
        list(sharded.generations())
    assert snapshot(tmp_path / "sharded") == snapshot(tmp_path / "whole")


def test_shards_of_any_number_add_up_to_the_batch(workers: Any, random_batch: Callable[..., TrialBatch]) -> None:
    with workers(2):
        for config in (PAPER, SCRIPTED):
            for n_trials in (1, 16, 17, 100):
                batch = random_batch(config, n_trials, 2)
                expected = as_bytes(FusedEvaluator(config.env, threads=1).evaluate(batch))
                for shards in (1, 2, 3, 50):
                    evaluator = ShardedEvaluator(config.env, shards, least_episodes=1)
                    assert as_bytes(evaluator.evaluate(batch)) == expected


def test_both_nodes_of_a_cluster_play(two_nodes: Any, processes: Any, random_batch: Callable[..., TrialBatch]) -> None:
    batch = random_batch(PAPER, 20_000, 6)
    results: list[TrialResult] = []
    thread = threading.Thread(target=lambda: results.append(ShardedEvaluator(PAPER.env, shards=4).evaluate(batch)))
    thread.start()
    for node in (two_nodes.first, two_nodes.second):
        processes.wait(lambda node=node: processes.at_work_on(node))
    thread.join()
    assert as_bytes(results[0]) == as_bytes(FusedEvaluator(PAPER.env).evaluate(batch))
    assert cluster.cores() == 2


def test_a_batch_too_small_to_share_is_played_here(
    random_batch: Callable[..., TrialBatch], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster, "submit", pytest.fail)
    batch = random_batch(PAPER, 100, 3)
    result = ShardedEvaluator(PAPER.env, shards=4, least_episodes=151).evaluate(batch)
    assert as_bytes(result) == as_bytes(FusedEvaluator(PAPER.env).evaluate(batch))


def test_what_is_wrong_with_a_batch_is_said_as_on_one_machine(
    workers: Any, random_batch: Callable[..., TrialBatch]
) -> None:
    batch = random_batch(PAPER, 64, 1)
    batch.starts[40, 0, 0, 0] = PAPER.env.size
    with workers(2), pytest.raises(ValueError, match=r"^starts must lie in \[0, 100\), got 0 to 100$"):
        ShardedEvaluator(PAPER.env, 2, least_episodes=1).evaluate(batch)


def test_a_node_with_another_version_is_refused(workers: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "_versions", lambda: {"predprey-esp": "9.9.9", "numpy": np.__version__})
    with (
        workers(1),
        pytest.raises(ValueError, match=r"^node .* has predprey-esp 0\.1\.0, .*; the driver has .* 9\.9\.9"),
    ):
        cluster.gather([cluster.submit(abs, -1)])


def test_train_plays_on_a_cluster_by_its_address(two_nodes: Any, tmp_path: Path, snapshot: Any) -> None:
    ray.shutdown()  # the command connects by itself
    run = ["train", "smoke", "--generations", "3", "--esp.n_trials", "1600", "--quiet"]
    assert main([*run, "--out", str(tmp_path / "here")]) == 0
    assert main([*run, "--out", str(tmp_path / "there"), "--address", two_nodes.address]) == 0
    assert snapshot(tmp_path / "there") == snapshot(tmp_path / "here")
    assert not ray.is_initialized()


@pytest.mark.parametrize(
    ("address", "says"),
    [
        ("localhost:1", "no Ray cluster answers at localhost:1"),
        ("somewhere", "the address of a Ray cluster must be HOST:PORT, auto or local, got somewhere"),
        ("somewhere:x", "no Ray cluster answers at somewhere:x"),
        ("auto", "no Ray cluster at auto: Could not find any running Ray instance."),
    ],
)
def test_without_a_cluster_nothing_begins(
    address: str, says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["train", "smoke", "--out", str(tmp_path / "run"), "--address", address]) == 1
    error = capsys.readouterr().err
    assert error.startswith(f"esp-trainer: {says}")
    assert error.count("\n") == 1
    assert not (tmp_path / "run").exists()


def test_without_ray_it_says_what_to_install(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "ray", None)
    assert main(["train", "smoke", "--out", str(tmp_path / "run"), "--address", "local"]) == 1
    assert capsys.readouterr().err == (
        'esp-trainer: a Ray cluster needs ray: install predprey-esp with its extra "ray"\n'
    )
    assert not (tmp_path / "run").exists()
