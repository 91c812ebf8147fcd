"""The reliability measurements in small: a sweep is killed, and disks are full."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPTS = Path(__file__).parents[1] / "scripts"
sys.path.insert(0, str(SCRIPTS))

import reliability  # noqa: E402
from reliability import WritingCommand, different, fill, half_written, kill, snapshot  # noqa: E402

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs process groups and tmpfs")

COUNTS_ITS_LIVES = """
import pathlib, time
pathlib.Path(".lives.part").touch()
with open("lives", "a") as file:
    file.write("x")
time.sleep(0.5)
pathlib.Path(".lives.part").unlink()
"""


def test_a_command_that_leaves_other_bytes_after_a_kill_is_a_fault(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(reliability, "TRAINER", [sys.executable, "-c", COUNTS_ITS_LIVES])
    _, done, faults = kill(WritingCommand("anything"), 1, tmp_path)
    assert done == 1
    assert faults == ["lives differs"]


def test_snapshots_differ_by_file_and_leave_out_wall_seconds(tmp_path: Path) -> None:
    for name in ("same", "other", "timing.jsonl", ".cut.part"):
        (tmp_path / name).write_text(name)
    found = snapshot(tmp_path)
    assert set(found) == {"same", "other", ".cut.part"}
    assert different(found, {"same": b"same", "other": b"", "gone": b""}) == [".cut.part", "gone", "other"]
    assert half_written(tmp_path) == [".cut.part"]


@pytest.mark.slow
def test_a_sweep_that_is_killed_ends_in_the_bytes_of_one_that_was_not(tmp_path: Path) -> None:
    _, done, faults = kill(reliability.KILLED["sweep"], 2, tmp_path, generations=20)
    assert faults == []
    assert done >= 1


@pytest.fixture(scope="module")
def may_mount(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Skip the test where one may not mount, as in most containers."""
    place = tmp_path_factory.mktemp("disk")
    command = ["mount", "-t", "tmpfs", "tmpfs", str(place)]
    if shutil.which("mount") is None or subprocess.run(command, capture_output=True, check=False).returncode:
        pytest.skip("no disk can be mounted here")
    subprocess.run(["umount", str(place)], check=True)


@pytest.mark.slow
@pytest.mark.usefixtures("may_mount")
@pytest.mark.parametrize(("name", "step"), [("train", 90), ("analyse", 200), ("sweep", 600)])
def test_a_full_disk_is_told_and_spoils_nothing(name: str, step: int, tmp_path: Path) -> None:
    failed, faults = fill(reliability.FILLED[name], tmp_path, step)
    assert faults == []
    assert failed >= 1


@pytest.mark.slow
def test_a_run_is_watched_generation_by_generation(tmp_path: Path) -> None:
    numbers, megabytes, cpu = zip(*reliability.watch(6, tmp_path), strict=True)
    assert numbers == (0, 1, 2, 3, 4, 5)
    assert min(megabytes) > 50
    assert min(cpu) > 0
