from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from esp_trainer.cli import main

SCRIPTS = Path(__file__).parents[1] / "scripts"

ROWS = (
    "`fused`, 64 episodes",
    "the same with linear outputs",
    "`fused`, two threads",
    "scalar Numba loops",
    "NumPy lockstep",
    "`reference`, extrapolated",
    "- of `fused`: scripts instead of networks",
    "- of `fused`: one hidden neuron",
    "- of a step of `reference`: the environment",
    "- of a step of `reference`: five agents' networks",
    "`parallel_env()`",
    "MPE `simple_tag`",
    "a loop that copies prebuilt dictionaries",
    "a generation of `paper-3v2`",
    "- trials",
    "- champions",
    "- held_out",
    "- breeding",
    "- files",
    "- rest",
    "champions, breeding, files and rest",
    "the same without champions",
    "450 generations at that rate",
    "`esp-trainer train paper-3v2",
    "its first generation, compiled anew",
    "its first generation, from the cache",
    "`import predprey_env`",
)


def benchmark(*options: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(SCRIPTS / "bench_throughput.py"), *options]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=600)


@pytest.mark.slow
def test_throughput_benchmark_fills_every_row_of_its_table() -> None:
    done = benchmark("--quick")
    assert done.returncode == 0, done.stderr
    header, _, *lines = [line for line in done.stdout.splitlines() if line.startswith("|")]
    assert header == "| what | figure | ratio | target | |"
    assert len(lines) == len(ROWS)
    for line, beginning in zip(lines, ROWS, strict=True):
        what, figure, ratio, *_ = (cell.strip() for cell in line.strip("|").split("|"))
        assert what.startswith(beginning)
        assert any(character.isdigit() for character in figure + ratio)


def test_throughput_benchmark_refuses_a_part_that_does_not_exist() -> None:
    done = benchmark("--only", "nothing")
    assert done.returncode == 2
    assert "invalid choice: 'nothing'" in done.stderr


def test_a_chase_is_drawn(tmp_path: Path) -> None:
    run = tmp_path / "run"
    assert main(["train", "smoke", "--generations", "1", "--out", str(run), "--quiet"]) == 0
    teams = [str(run / f"champions/{role}-00000.safetensors") for role in ("predators", "prey")]
    out = tmp_path / "chase.png"
    command = [sys.executable, str(SCRIPTS / "draw_chase.py"), *teams, "--seed", "3", "--out", str(out)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=600)
    assert done.returncode == 0, done.stderr
    assert out.read_bytes().startswith(b"\x89PNG")
