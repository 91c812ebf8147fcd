"""Runs on a Ray cluster of two nodes, and without one."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import pytest
import ray
from waiting import wait

from esp_trainer import cluster
from esp_trainer.cli import main
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.evaluation.sharded import ShardedEvaluator
from esp_trainer.presets import preset

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from esp_trainer.types import TrialBatch

PAPER = preset("paper-3v2")


@pytest.mark.slow
def test_both_nodes_of_a_cluster_play_and_one_that_is_killed_costs_only_its_shards(
    two_nodes: Any, processes: Any, play_and: Any, random_batch: Callable[..., TrialBatch]
) -> None:
    batch = random_batch(PAPER, 10_000, 6)
    assert cluster.cluster_cores() == 2

    def both_at_work() -> bool:
        return all(processes.at_work_on(node) for node in (two_nodes.first, two_nodes.second))

    result = play_and(lambda _: two_nodes.kill_second(), batch, both_at_work)
    expected = FusedEvaluator(PAPER.env).evaluate(batch)
    for name in ("fitness", "captured", "steps"):
        assert getattr(result, name).tobytes() == getattr(expected, name).tobytes()
    wait(lambda: cluster.cluster_cores() == 1)


@pytest.mark.slow
def test_train_plays_on_a_cluster_by_its_address(two_nodes: Any, tmp_path: Path, snapshot: Any) -> None:
    ray.shutdown()  # the command connects by itself
    run = ["train", "smoke", "--generations", "3", "--esp.n_trials", "1600", "--quiet"]
    assert main([*run, "--out", str(tmp_path / "here")]) == 0
    assert main([*run, "--out", str(tmp_path / "there"), "--address", two_nodes.address]) == 0
    assert snapshot(tmp_path / "there") == snapshot(tmp_path / "here")
    assert not ray.is_initialized()


def test_a_batch_too_small_to_share_is_played_here(
    random_batch: Callable[..., TrialBatch], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster, "submit", pytest.fail)
    batch = random_batch(PAPER, 100, 3)
    result = ShardedEvaluator(PAPER.env, shards=4, least_episodes=151).evaluate(batch)
    assert (result.fitness == FusedEvaluator(PAPER.env).evaluate(batch).fitness).all()


@pytest.mark.slow
@pytest.mark.usefixtures("only_cluster")  # or `auto` finds one
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
    monkeypatch.setitem(sys.modules, "ray", None)
    assert main(["train", "smoke", "--out", str(tmp_path / "run"), "--address", "local"]) == 1
    assert capsys.readouterr().err == ('esp-trainer: a Ray cluster needs ray: pip install "predprey-esp[ray]"\n')
    assert not (tmp_path / "run").exists()
