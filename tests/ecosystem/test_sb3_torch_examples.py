"""The single-file examples in PyTorch: they run with few steps, and tell what they reach."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from waiting import PATIENCE

pytestmark = pytest.mark.ecosystem

EXAMPLES = Path(__file__).parents[2] / "examples"
OPTIONS = {
    "ppo_one_team.py": ["--task", "meadow", "--team", "prey", "--n-worlds", "8", "--see", "teammates,scaled"],
    "self_play.py": ["--task", "meadow", "--reports", "2"],
    "mappo.py": ["--task", "meadow", "--reports", "2", "--critic", "own"],
}


@pytest.mark.parametrize("name", OPTIONS)
def test_an_example_takes_steps_and_prints_what_it_reached(name: str, tmp_path: Path) -> None:
    command = [sys.executable, str(EXAMPLES / name), "--steps", "3000", *OPTIONS[name]]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=PATIENCE)
    assert done.returncode == 0, done.stderr
    lines = re.findall(r"^ +([\d,]+) steps, +\d+ CPU-seconds: (\d\.\d\d) (.*)", done.stdout, re.MULTILINE)
    steps = [int(line[0].replace(",", "")) for line in lines]
    assert steps[0] == 0
    assert steps[-1] >= 3000
    assert all(0 <= float(caught) <= 1 for _, caught, _ in lines)


def test_learning_curves_are_measured_and_reported(tmp_path: Path) -> None:
    script = [sys.executable, str(EXAMPLES.parent / "scripts/learning_curves.py"), "--quick", "--out", str(tmp_path)]
    for more in (["--runs", str(tmp_path / "runs"), "--workers", "1"], ["--report"]):
        done = subprocess.run([*script, *more], capture_output=True, text=True, check=False, timeout=PATIENCE)
        assert done.returncode == 0, done.stderr
    page = (tmp_path / "learning.md").read_text()
    for name in ("pond, predators", "pond, prey", "team-mates", "evolved, race"):
        assert f"| {name} |" in page
    assert "nan" not in page
    assert (tmp_path / "learning/curves.png").exists()
