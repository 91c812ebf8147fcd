from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from esp_trainer import Team
from esp_trainer.cli import main
from predprey_env import EnvConfig, PredPreyEnv

SCRIPT = Path(__file__).parents[1] / "scripts/draw_chase.py"


def draw_chase(*options: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(SCRIPT), *options]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=600)


@pytest.fixture(scope="module")
def teams(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """The files of predators and of prey."""
    run = tmp_path_factory.mktemp("runs") / "run"
    assert main(["train", "smoke", "--generations", "1", "--out", str(run), "--quiet"]) == 0
    return [str(run / f"champions/{role}-00000.safetensors") for role in ("predators", "prey")]


@pytest.mark.parametrize(
    ("suffix", "beginning"), [(".png", b"\x89PNG"), (".gif", b"GIF89a"), (".mp4", b"\0\0\0\x20ftyp")]
)
def test_a_chase_is_drawn(teams: list[str], tmp_path: Path, suffix: str, beginning: bytes) -> None:
    out = tmp_path / f"chase{suffix}"
    done = draw_chase(*teams, "--seed", "3", "--out", str(out))
    assert done.returncode == 0, done.stderr
    assert done.stdout == f"seed 3: {out}\n"
    assert out.read_bytes().startswith(beginning)


def test_without_a_seed_a_chase_with_the_most_prey_caught_is_drawn(teams: list[str], tmp_path: Path) -> None:
    done = draw_chase(*teams, "--out", str(tmp_path / "chase.png"))
    assert done.returncode == 0, done.stderr
    seed = int(done.stdout.split(":")[0].removeprefix("seed "))
    predators, prey = (Team.load(team) for team in teams)
    env = PredPreyEnv(EnvConfig.from_dict(predators.provenance["env"]))
    endings = []
    for other in range(100):
        observations, infos = env.reset(seed=other)
        while env.agents:
            observations, *_, infos = env.step(predators.act(observations) | prey.act(observations))
        endings.append((-infos["prey_0"]["n_captured"], infos["prey_0"]["steps"]))
    assert endings[seed] == min(endings)
    assert endings.index(min(endings)) == seed


def test_a_chase_as_anything_else_is_refused_in_one_line(teams: list[str], tmp_path: Path) -> None:
    done = draw_chase(*teams, "--seed", "3", "--out", str(tmp_path / "chase.avi"))
    assert done.returncode == 2
    assert "error: a video must be a .gif or .mp4 file, got " in done.stderr
    assert "Traceback" not in done.stderr
