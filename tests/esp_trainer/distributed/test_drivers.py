"""Drivers that are stopped or killed in the middle of a generation, and a node in the middle of a sweep."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import pytest
import ray
from waiting import PATIENCE, wait

from esp_trainer.cli import main

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("only_cluster")]

LARGE = ["train", "smoke", "--generations", "12", "--checkpoint_every", "3", "--esp.n_trials", "10000", "--quiet"]
N = 120  # generations of a run of the sweep


def begin(*arguments: object) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "esp_trainer", *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)


@pytest.fixture(scope="module")
def large(tmp_path_factory: pytest.TempPathFactory, snapshot: Any) -> dict[str, bytes]:
    """What the large run leaves on this machine alone."""
    path = tmp_path_factory.mktemp("large") / "run"
    assert main([*LARGE, "--out", str(path)]) == 0
    return dict(snapshot(path))


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT], ids=lambda number: number.name)
def test_a_driver_that_is_stopped_leaves_nobody_behind_and_resumes_to_the_same_bytes(
    number: signal.Signals, processes: Any, tmp_path: Path, snapshot: Any, large: dict[str, bytes]
) -> None:
    path = tmp_path / "run"
    driver = begin(*LARGE, "--out", path, "--address", "local")
    wait(lambda: driver.poll() is not None or (path / "checkpoint.safetensors").exists())
    wait(lambda: driver.poll() is not None or processes.at_work())
    family = processes.descendants(driver.pid)
    assert any("raylet" in processes.title(pid) for pid in family)
    os.killpg(driver.pid, number)  # as Ctrl-C on a terminal does, to all that are in the foreground
    _, error = driver.communicate(timeout=PATIENCE)
    assert driver.returncode == (128 + signal.SIGINT if number is signal.SIGINT else -signal.SIGKILL)
    assert ("go on with: esp-trainer resume" in error) == (number is signal.SIGINT)
    assert "Traceback" not in error
    wait(lambda: not any(processes.title(pid) for pid in family))
    assert main(["resume", str(path), "--quiet"]) == 0
    assert snapshot(path) == large


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("sweep") / "sweep.toml"
    path.write_text(f'preset = "smoke"\nseeds = 2\n[fields]\ngenerations = {N}\ncheckpoint_every = 2\n')
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


def under_way(out: Path) -> bool:
    return len(list(out.glob("*/checkpoint.safetensors"))) >= 2


def test_a_node_that_is_killed_costs_a_sweep_only_time(
    two_nodes: Any, file: Path, tmp_path: Path, processes: Any, runs: Any, whole: Any
) -> None:
    ray.shutdown()  # the command connects by itself
    driver = begin("sweep", file, "--out", tmp_path, "--address", two_nodes.address)
    wait(lambda: processes.at_work_on(two_nodes.second) and under_way(tmp_path))
    two_nodes.kill_second()
    output, error = driver.communicate(timeout=PATIENCE)
    assert driver.returncode == 0, error
    assert "smoke     2/2" in output
    assert runs(tmp_path) == whole


def test_a_sweep_that_is_stopped_leaves_nobody_behind_and_goes_on(
    file: Path, tmp_path: Path, processes: Any, runs: Any, whole: Any
) -> None:
    driver = begin("sweep", file, "--out", tmp_path, "--address", "local")
    wait(lambda: driver.poll() is not None or under_way(tmp_path))
    family = processes.descendants(driver.pid)
    os.killpg(driver.pid, signal.SIGINT)
    _, error = driver.communicate(timeout=PATIENCE)
    assert driver.returncode == 128 + signal.SIGINT
    assert "Traceback" not in error
    wait(lambda: not any(processes.title(pid) for pid in family))
    assert runs(tmp_path) != whole
    assert main(["sweep", str(file), "--out", str(tmp_path), "--workers", "2"]) == 0
    assert runs(tmp_path) == whole
