"""How many cores there are: the affinity mask and every quota of a container count."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from esp_trainer import cores as module
from esp_trainer.cores import cores

V1, V1_OF_THE_HOST = "4:cpu,cpuacct:/a/b\n3:memory:/a\n", "4:cpu,cpuacct:/docker/0123\n"


@pytest.mark.parametrize(
    ("membership", "files", "expected"),
    [
        ("0::/\n", {}, 8),
        ("0::/\n", {"cpu.max": "max 100000\n"}, 8),
        ("0::/\n", {"cpu.max": "100000 100000\n"}, 1),
        ("0::/\n", {"cpu.max": "50000 100000\n"}, 1),
        ("0::/\n", {"cpu.max": "150000 100000\n"}, 2),
        ("0::/\n", {"cpu.max": "1600000 100000\n"}, 8),
        ("0::/a/b\n", {"a/b/cpu.max": "max 100000\n", "a/cpu.max": "300000 100000\n"}, 3),
        ("0::/a/b\n", {"a/b/cpu.max": "200000 100000\n", "a/cpu.max": "300000 100000\n"}, 2),
        ("0::/../elsewhere\n", {"cpu.max": "200000 100000\n"}, 2),
        ("0::/a:b\n", {"a:b/cpu.max": "200000 100000\n"}, 2),
        (V1, {"cpu,cpuacct/a/b/cpu.cfs_quota_us": "-1\n", "cpu,cpuacct/a/b/cpu.cfs_period_us": "100000\n"}, 8),
        (V1, {"cpu,cpuacct/a/b/cpu.cfs_quota_us": "100000\n", "cpu,cpuacct/a/b/cpu.cfs_period_us": "50000\n"}, 2),
        # A container that sees its path on the host finds its own group at the top.
        (V1_OF_THE_HOST, {"cpu,cpuacct/cpu.cfs_quota_us": "1", "cpu,cpuacct/cpu.cfs_period_us": "1"}, 1),
        # The folder is cpu,cpuacct with a link from cpu.
        ("4:cpuacct,cpu:/docker/0123\n", {"cpu/cpu.cfs_quota_us": "2", "cpu/cpu.cfs_period_us": "1"}, 2),
        ("4:cpuacct,cpu:/\n", {"cpuacct,cpu/cpu.cfs_quota_us": "2", "cpuacct,cpu/cpu.cfs_period_us": "1"}, 2),
        ("0::/\n", {"cpu.max": "a word\n"}, 8),
        ("nonsense\n", {"cpu.max": "100000 100000\n"}, 8),
    ],
)
def test_the_smallest_quota_around_a_process_counts(
    membership: str, files: dict[str, str], expected: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "membership").write_text(membership)
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.setattr(module, "_MEMBERSHIP", tmp_path / "membership")
    monkeypatch.setattr(module, "_GROUPS", tmp_path)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: range(8), raising=False)
    assert cores() == expected


def test_without_control_groups_the_affinity_mask_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_MEMBERSHIP", tmp_path / "none")
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {3, 5}, raising=False)
    assert cores() == 2
    monkeypatch.delattr(os, "sched_getaffinity")
    monkeypatch.setattr(os, "cpu_count", lambda: None)
    assert cores() == 1
