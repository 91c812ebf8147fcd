"""OpenSpiel: the example's game, whose value iteration agrees with the exact solution."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from waiting import PATIENCE

pytestmark = pytest.mark.ecosystem

EXAMPLE = Path(__file__).parents[2] / "examples/openspiel_game.py"


@pytest.mark.parametrize(("options", "value"), [(["--quick"], 0.2389), ([], 0.5444)])
def test_value_iteration_agrees_with_the_exact_solution(options: list[str], value: float, tmp_path: Path) -> None:
    command = [sys.executable, str(EXAMPLE), *options]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=PATIENCE)
    assert done.returncode == 0, done.stderr
    starts = re.findall(r"^predators at .*: OpenSpiel (\S+), esp_trainer (\S+)$", done.stdout, re.MULTILINE)
    assert len(starts) == 6
    assert all(theirs == ours for theirs, ours in starts)
    assert len({ours for _, ours in starts}) > 1, "the starts differ in value"
    (mean, exact, apart), *_ = re.findall(
        r"^all 225 starts: (\S+), (\S+), at most (\S+) apart$", done.stdout, re.MULTILINE
    )
    assert float(mean) == float(exact) == value
    assert float(apart) < 1e-6
