"""Workers, nodes and drivers that are really killed in the middle of a generation."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from typing import TYPE_CHECKING, Any

import pytest

from esp_trainer import cluster
from esp_trainer.cli import main
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.evaluation.sharded import ShardedEvaluator
from esp_trainer.presets import preset

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from esp_trainer.types import TrialBatch, TrialResult

pytestmark = pytest.mark.slow

PAPER = preset("paper-3v2")
PATIENCE = 60.0  # seconds
COMMAND = [sys.executable, "-m", "esp_trainer"]
LARGE = ["train", "smoke", "--generations", "40", "--checkpoint_every", "3", "--esp.n_trials", "20000", "--quiet"]


def play_and(kill: Callable[[], None], batch: TrialBatch, when: Callable[[], Any], processes: Any) -> TrialResult:
    """Play a batch in shards, and kill something while they are played."""
    results: list[TrialResult] = []
    evaluator = ShardedEvaluator(PAPER.env, shards=4)
    evaluator.evaluate(batch.part(slice(400)))  # workers are up, with their kernels
    thread = threading.Thread(target=lambda: results.append(evaluator.evaluate(batch)))
    thread.start()
    processes.wait(when)
    kill()
    thread.join(PATIENCE)
    (result,) = results
    return result


def same(result: TrialResult, batch: TrialBatch) -> bool:
    expected = FusedEvaluator(PAPER.env).evaluate(batch)
    return all(
        getattr(result, name).tobytes() == getattr(expected, name).tobytes()
        for name in ("fitness", "captured", "steps")
    )


def test_a_worker_that_is_killed_costs_only_its_shard(
    workers: Any, processes: Any, random_batch: Callable[..., TrialBatch]
) -> None:
    killed: list[int] = []

    def kill() -> None:
        killed.extend(processes.at_work()[:1])
        os.kill(killed[0], signal.SIGKILL)

    batch = random_batch(PAPER, 20_000, 6)
    with workers(2):
        result = play_and(kill, batch, processes.at_work, processes)
        assert not processes.title(killed[0])
    assert same(result, batch)


def test_a_node_that_is_killed_costs_only_its_shards(
    two_nodes: Any, processes: Any, random_batch: Callable[..., TrialBatch]
) -> None:
    batch = random_batch(PAPER, 20_000, 6)
    result = play_and(two_nodes.kill_second, batch, lambda: processes.at_work_on(two_nodes.second), processes)
    assert same(result, batch)
    processes.wait(lambda: cluster.cores() == 1)


def test_what_kills_every_worker_is_given_up(workers: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "RETRIES", 1)
    with workers(1), pytest.raises(ConnectionError, match=r"^the Ray cluster lost a task: The worker died") as raised:
        cluster.gather([cluster.submit(os._exit, 3)])
    assert "\n" not in str(raised.value)


def begin(*arguments: object) -> subprocess.Popen[str]:
    return subprocess.Popen([*COMMAND, *map(str, arguments)], stderr=subprocess.PIPE, text=True, start_new_session=True)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT], ids=lambda number: number.name)
def test_a_driver_that_is_stopped_leaves_nobody_behind_and_resumes_to_the_same_bytes(
    number: signal.Signals, processes: Any, tmp_path: Path, snapshot: Any
) -> None:
    path = tmp_path / "run"
    driver = begin(*LARGE, "--out", path, "--address", "local")
    processes.wait(lambda: driver.poll() is not None or (path / "checkpoint.safetensors").exists())
    processes.wait(lambda: driver.poll() is not None or processes.at_work())
    family = processes.descendants(driver.pid)
    assert any("raylet" in processes.title(pid) for pid in family)
    os.killpg(driver.pid, number)  # as Ctrl-C on a terminal does, to all that are in the foreground
    _, error = driver.communicate(timeout=PATIENCE)
    assert driver.returncode == (128 + signal.SIGINT if number is signal.SIGINT else -signal.SIGKILL)
    assert ("go on with: esp-trainer resume" in error) == (number is signal.SIGINT)
    assert "Traceback" not in error
    processes.wait(lambda: not any(processes.title(pid) for pid in family))
    assert main(["resume", str(path), "--quiet"]) == 0
    assert main([*LARGE, "--out", str(tmp_path / "whole")]) == 0
    assert snapshot(path) == snapshot(tmp_path / "whole")
