"""Time a newcomer's first policy: from an environment with Stable-Baselines3 to predators that beat all scripts.

    python scripts/first_policy.py

It makes a virtual environment with Stable-Baselines3 in a temporary directory, which is not timed. Then it installs the
project and runs ``examples/sb3_pond.py``, which trains, measures and films, with nothing compiled before. It prints the
seconds of each step, and fails if the policy does not beat the best script or there is no film. On Linux, set
PIP_EXTRA_INDEX_URL=https://download.pytorch.org/whl/cpu to take the small PyTorch.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import time
import venv
from pathlib import Path

import numpy as np
from study import machine, table

ROOT = Path(__file__).resolve().parents[1]


class Newcomer:
    """A fresh virtual environment, and an empty directory to work in."""

    def __init__(self, place: Path) -> None:
        venv.create(place / "venv", with_pip=True)
        self._python = place / "venv" / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
        kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "NUMBA"))}
        self._variables = kept | {"NUMBA_CACHE_DIR": str(place / "cache")}
        self.work = place / "work"
        self.work.mkdir()

    def run(self, *arguments: str | Path) -> tuple[np.ndarray, str]:
        """Run Python; return the wall seconds and the CPU seconds that it took, and what it printed."""
        begun = _clocks()
        done = subprocess.run(
            [self._python, *arguments],
            cwd=self.work,
            env=self._variables,
            check=True,
            text=True,
            stdout=subprocess.PIPE,
        )
        return _clocks() - begun, done.stdout


def _clocks() -> np.ndarray:
    """Return the wall clock and the CPU seconds of all processes that ended (0 on Windows)."""
    times = os.times()
    return np.array([time.perf_counter(), times.children_user + times.children_system])


def main() -> int:
    """Do what a newcomer does, and print the table."""
    with tempfile.TemporaryDirectory() as name:
        newcomer = Newcomer(Path(name))
        newcomer.run("-m", "pip", "install", "--quiet", "stable-baselines3>=2.9")
        install, _ = newcomer.run("-m", "pip", "install", "--quiet", f"{ROOT}[render]")
        example, printed = newcomer.run(ROOT / "examples/sb3_pond.py")
        film = newcomer.work / "pond.gif"
        filmed = film.exists() and film.stat().st_size > 0
    best_script, *reached = (float(each) for each in re.findall(r": (\d\.\d\d) of the prey caught", printed))
    taken = {
        '`pip install ".[render]"`': install,
        "`examples/sb3_pond.py`: compile, train, measure, film": example,
        "both": install + example,
    }
    print(
        table(
            ["step", "wall s", "CPU s"],
            [(what, *seconds.round().astype(int)) for what, seconds in taken.items()],
            "---:",
        )
    )
    print(f"\nThe policy catches {reached[-1]:.2f} of the prey, the best script {best_script:.2f}; film: {filmed}.")
    print(f"{machine(['numba', 'numpy'])}; load {os.getloadavg()[0]:.1f}.")
    return int(reached[-1] <= best_script or not filmed)


if __name__ == "__main__":
    sys.exit(main())
