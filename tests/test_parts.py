"""The measures of ``scripts/compare_parts.py``, by hand."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from esp_trainer.sweep.plan import read_plan

SCRIPTS = Path(__file__).parents[1] / "scripts"
sys.path.insert(0, str(SCRIPTS))

from parts import report  # noqa: E402

MET = {
    "condition": np.array(["esp", "esp", "ga", "ga"]),
    "met": np.array([[0.9, 0.2, 0.4, 0.6], [0.6, 0.9, 0.0, 0.2], [0.5, 0.1, 0.9, 0.3], [0.1, 0.1, 0.2, 0.9]]),
}
"""What each run's predators (rows) catch of each run's prey; the diagonal is each run against itself."""


def test_all_others_are_the_other_runs_and_conditions_count_alike() -> None:
    """The first run's predators meet one other of ``esp`` (0.2), and two of ``ga`` (0.5 in the mean)."""
    np.testing.assert_allclose(report.against_all(MET, "predators"), [0.35, 0.35, 0.3, 0.15])


def test_prey_count_what_escapes() -> None:
    """The first run's prey escape one other of ``esp`` (0.4), and two of ``ga`` (0.7 in the mean)."""
    np.testing.assert_allclose(report.against_all(MET, "prey"), [0.55, 0.85, 0.8, 0.65])


@pytest.mark.parametrize("plan", ["algorithms-3v1", "algorithms-steppe", "senses-3v1"])
def test_conditions_differ_in_one_part_alone(plan: str) -> None:
    """Every condition has ten seeds, and what it breeds has as many episodes as the first."""
    runs = read_plan(SCRIPTS / "studies" / f"{plan}.toml")
    seeds = {name: [run.config.seed for run in runs if run.cell == name] for name in {run.cell for run in runs}}
    assert len(seeds) == 5
    assert all(each == list(range(10)) for each in seeds.values())
    assert len({(run.config.generations, run.config.esp, run.config.champion) for run in runs}) == 1


@pytest.mark.slow
def test_the_studies_run_in_small(tmp_path: Path) -> None:
    command = [sys.executable, str(SCRIPTS / "compare_parts.py"), "--quick", "--only", "senses-3v1"]
    subprocess.run([*command, "--runs", str(tmp_path / "runs"), "--out", str(tmp_path)], check=True)
    page = (tmp_path / "senses.md").read_text()
    assert "`team-mates`" in page
    assert (tmp_path / "senses" / "level.png").stat().st_size > 10_000
