"""Sweeps whose runs are tasks on a Ray cluster."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
import ray

from esp_trainer.cli import main
from esp_trainer.sweep.on_cluster import ClusterPool
from esp_trainer.sweep.plan import read_plan
from esp_trainer.sweep.pool import Work

if TYPE_CHECKING:
    from collections.abc import Iterator

pytestmark = pytest.mark.slow

N = 120


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("sweep") / "sweep.toml"
    path.write_text(f'preset = "smoke"\nseeds = 3\n[fields]\ngenerations = {N}\ncheckpoint_every = 2\n')
    return path


@pytest.fixture(scope="module")
def whole(file: Path, tmp_path_factory: pytest.TempPathFactory, runs: Any) -> dict[str, dict[str, bytes]]:
    """What a sweep in one process of this machine leaves."""
    out = tmp_path_factory.mktemp("whole")
    assert main(["sweep", str(file), "--out", str(out), "--workers", "1"]) == 0
    return dict(runs(out))


@pytest.fixture(scope="module")
def runs(snapshot: Any) -> Any:
    """``runs(out)``: of each run of a sweep, what it left."""

    def read(out: Path) -> dict[str, dict[str, bytes]]:
        return {path.name: snapshot(path) for path in out.iterdir() if path.is_dir()}

    return read


@pytest.fixture
def connected_by_itself(two_nodes: Any) -> Iterator[Any]:
    """Two nodes, for a command that connects by itself."""
    ray.shutdown()
    return two_nodes


def under_way(out: Path) -> bool:
    return len(list(out.glob("*/checkpoint.safetensors"))) >= 2


def begin(file: Path, out: Path, address: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "esp_trainer", "sweep", str(file), "--out", str(out), "--address", address]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)


def test_a_node_that_is_killed_costs_only_time(
    connected_by_itself: Any, file: Path, tmp_path: Path, processes: Any, runs: Any, whole: Any
) -> None:
    nodes = connected_by_itself
    driver = begin(file, tmp_path, nodes.address)
    processes.wait(lambda: processes.at_work_on(nodes.second) and under_way(tmp_path))
    nodes.kill_second()
    output, error = driver.communicate(timeout=120)
    assert driver.returncode == 0, error
    assert "smoke     3/3" in output
    assert runs(tmp_path) == whole


def test_a_driver_that_is_stopped_leaves_nobody_behind_and_goes_on(
    file: Path, tmp_path: Path, processes: Any, runs: Any, whole: Any
) -> None:
    driver = begin(file, tmp_path, "local")
    processes.wait(lambda: driver.poll() is not None or under_way(tmp_path))
    family = processes.descendants(driver.pid)
    os.killpg(driver.pid, signal.SIGINT)
    _, error = driver.communicate(timeout=60)
    assert driver.returncode == 128 + signal.SIGINT
    assert "Traceback" not in error
    processes.wait(lambda: not any(processes.title(pid) for pid in family))
    assert runs(tmp_path) != whole
    assert main(["sweep", str(file), "--out", str(tmp_path), "--workers", "2"]) == 0
    assert runs(tmp_path) == whole


def test_a_node_that_does_not_see_the_directory_says_so(workers: Any, file: Path) -> None:
    (run, *_) = read_plan(file)
    with workers(1):
        pool = ClusterPool([Work(Path("/not-shared/sweep") / run.name, run.config)])
        (outcome,) = pool.outcomes(60.0)
    assert outcome.reason is not None
    assert outcome.reason.endswith(
        " does not see /not-shared/sweep: the runs of a sweep need a directory that all nodes share"
    )
