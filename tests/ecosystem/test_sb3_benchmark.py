"""What needs PyTorch or Stable-Baselines3 in the benchmark: models as candidates, the tutorial, and the PPO baseline.

Run with the tests of Stable-Baselines3, by ``scripts/ecosystem.py sb3``.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from safetensors.torch import save_file
from stable_baselines3 import A2C, PPO
from torch import nn
from waiting import PATIENCE

from esp_trainer import Team
from esp_trainer.benchmark.batched import SB3Policy, TorchPolicy
from esp_trainer.benchmark.match import Arena
from esp_trainer.benchmark.specs import load_candidate
from esp_trainer.cli import main
from esp_trainer.tasks import WORLDS
from esp_trainer.types import PolicyError, ScriptedTeams
from predprey_env import vector_env
from predprey_env.sb3 import SB3VecEnv

pytestmark = pytest.mark.ecosystem

ROOT = Path(__file__).parents[2]
SCRIPTS = ROOT / "scripts"
ENV = WORLDS["3v2"]
PREDATORS = ENV.team("predators")
NETS = """
from torch import nn

def make():
    return nn.Sequential(nn.Linear(4, 16), nn.Tanh(), nn.Linear(16, 5))

def wide():
    return nn.Linear(4, 7)
"""


@pytest.fixture(scope="module")
def zip_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An untrained model of predators of two prey."""
    file = tmp_path_factory.mktemp("sb3") / "model.zip"
    PPO("MlpPolicy", SB3VecEnv(vector_env(2, "predators", "random", "SameStep")), seed=1, device="cpu").save(file)
    return file


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A directory with a module that makes networks, and weights of one."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "nets", raising=False)
    (tmp_path / "nets.py").write_text(NETS)
    torch.manual_seed(0)
    weights = nn.Sequential(nn.Linear(4, 16), nn.Tanh(), nn.Linear(16, 5)).state_dict()
    torch.save(weights, "weights.pt")
    save_file(weights, "weights.safetensors")
    return tmp_path


def views(n_worlds: int = 40) -> np.ndarray:
    shape = (n_worlds, PREDATORS.n_agents, PREDATORS.n_seen)
    return np.random.default_rng(0).integers(-50, 50, shape).astype(np.float32)


def test_a_model_of_sb3_does_what_it_predicts(zip_file: Path) -> None:
    candidate = load_candidate(f"sb3:PPO:{zip_file}", "predators", ENV)
    expected, _ = PPO.load(zip_file, device="cpu").predict(views().reshape(-1, 4), deterministic=True)
    assert candidate.player.act_batch(views()).ravel().tolist() == expected.tolist()
    assert "unpickled" in candidate.caution


def test_what_a_model_draws_follows_from_the_seed(zip_file: Path) -> None:
    policy: Any = load_candidate(f"sb3:PPO:{zip_file}", "predators", ENV, drawn=True).player

    def draw(seed: int) -> list[Any]:
        policy.reset(seed)
        return [policy.act_batch(views()).tolist() for _ in range(3)]

    assert draw(5) == draw(5)
    assert draw(5) != draw(6)
    assert draw(5)[0] != draw(5)[1]


def test_a_model_with_other_spaces_is_refused(zip_file: Path) -> None:
    for role, task in (("prey", "3v2"), ("predators", "3v1")):
        with pytest.raises(ValueError, match=r"^the model must observe \d numbers and have \d actions, got Box"):
            load_candidate(f"sb3:PPO:{zip_file}", role, WORLDS[task])


def test_a_file_that_is_no_model_is_refused_in_one_line(tmp_path: Path, zip_file: Path) -> None:
    other = tmp_path / "other.zip"
    other.write_bytes(b"not a zip")
    for spec in (f"sb3:PPO:{other}", f"sb3:DQN:{zip_file}"):
        with pytest.raises(
            PolicyError, match=r"^\S+ is not a model that \w+ of Stable-Baselines3 can load: .+"
        ) as refused:
            load_candidate(spec, "predators", ENV)
        assert "\n" not in str(refused.value)
    with pytest.raises(PolicyError, match=r"^stable_baselines3 has no NOTHING$"):
        load_candidate(f"sb3:NOTHING:{zip_file}", "predators", ENV)


def test_an_actor_critic_of_another_kind_works_too(tmp_path: Path) -> None:
    A2C("MlpPolicy", SB3VecEnv(vector_env(2, "prey", "random", "SameStep")), device="cpu").save(tmp_path / "model")
    candidate = load_candidate(f"sb3:stable_baselines3.A2C:{tmp_path / 'model.zip'}", "prey", ENV)
    assert candidate.player.act_batch(np.zeros((2, 2, 6), np.float32)).shape == (2, 2)


@pytest.mark.parametrize("weights", ["weights.pt", "weights.safetensors"])
def test_a_module_of_torch_takes_the_action_with_the_highest_output(weights: str, place: Path) -> None:
    candidate = load_candidate(f"torch:nets:make:{weights}", "predators", ENV)
    network = nn.Sequential(nn.Linear(4, 16), nn.Tanh(), nn.Linear(16, 5))
    network.load_state_dict(torch.load(place / "weights.pt", weights_only=True))
    expected = network(torch.from_numpy(views())).argmax(-1)
    assert candidate.player.act_batch(views()).tolist() == expected.tolist()
    assert candidate.caution == "nets was imported"


def test_a_module_of_torch_draws_by_the_softmax_of_its_outputs() -> None:
    class Fixed(nn.Module):
        def forward(self, rows: torch.Tensor) -> torch.Tensor:
            return torch.log(torch.tensor([0.1, 0.2, 0.3, 0.4, 1e-9])).expand(len(rows), 5) + 7

    policy = TorchPolicy(Fixed(), PREDATORS, drawn=True)
    policy.reset(0)
    counts = np.bincount(policy.choose(np.zeros((20_000, 4), np.float32)), minlength=5)
    np.testing.assert_allclose(counts / 20_000, [0.1, 0.2, 0.3, 0.4, 0], atol=0.015)
    assert set(TorchPolicy(Fixed(), PREDATORS).choose(np.zeros((9, 4), np.float32))) == {3}
    seen = np.zeros((2, 3, 4), np.float32)
    np.testing.assert_allclose(policy.chances_batch(seen), np.full((2, 3, 5), [0.1, 0.2, 0.3, 0.4, 0]), atol=1e-6)


def test_a_model_of_sb3_draws_with_the_chances_that_it_says(zip_file: Path) -> None:
    policy: Any = load_candidate(f"sb3:PPO:{zip_file}", "predators", ENV, drawn=True).player
    likely: Any = load_candidate(f"sb3:PPO:{zip_file}", "predators", ENV).player
    chances = policy.chances_batch(views())
    assert chances.shape == (40, 3, 5)
    np.testing.assert_allclose(chances.sum(axis=2), 1, atol=1e-6)
    assert (chances.argmax(axis=2) == likely.act_batch(views())).all()
    policy.reset(0)
    drawn = policy.act_batch(np.repeat(views()[:1], 4000, axis=0))[:, 0]
    np.testing.assert_allclose(np.bincount(drawn, minlength=5) / 4000, chances[0, 0], atol=0.04)


def test_how_far_a_model_is_from_optimal_play_is_one_command(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    worlds = vector_env(2, "prey", "random", "SameStep", size=4, n_prey=1)
    PPO("MlpPolicy", SB3VecEnv(worlds), device="cpu", seed=0).save(tmp_path / "model")
    command = ["exploitability", f"sb3:PPO:{tmp_path / 'model.zip'}", "--role", "prey", "--size", "4", "--steps", "3"]
    losses = []
    for drawn in ([], ["--drawn"]):
        assert main([*command, *drawn]) == 0
        losses.append(float(capsys.readouterr().out.split("exploitability: ")[1].split()[0]))
    assert 0 < losses[1] < losses[0]  # untrained, it draws nearly evenly


def test_weights_that_hide_code_are_not_run(place: Path) -> None:
    class Trap:
        def __reduce__(self) -> Any:
            return Path.touch, (place / "sprung",)

    torch.save(Trap(), "trap.pt")
    with pytest.raises(PolicyError, match=r"^trap\.pt does not hold weights for nets:make: "):
        load_candidate("torch:nets:make:trap.pt", "predators", ENV)
    assert not (place / "sprung").exists()


def test_a_module_with_other_outputs_is_told_so_when_it_plays(place: Path) -> None:
    torch.save(nn.Linear(4, 7).state_dict(), "wide.pt")
    wide = load_candidate("torch:nets:wide:wide.pt", "predators", ENV).player
    expected = r"^the policy's act_batch\(\) raised ValueError: the module must return \(24, 5\) logits or \(24,\) int"
    with pytest.raises(PolicyError, match=expected):
        Arena(ENV, 8, 0).meet(wide, "predators", ScriptedTeams("random"))

    class Nothing(nn.Module):
        def forward(self, rows: torch.Tensor) -> torch.Tensor:
            return torch.full((len(rows), 5), float("nan"))

    with pytest.raises(PolicyError, match="the module must return numbers, got NaN"):
        Arena(ENV, 8, 0).meet(TorchPolicy(Nothing(), PREDATORS), "predators", ScriptedTeams("random"))


def test_a_model_plays_a_whole_meeting(zip_file: Path) -> None:
    policy = SB3Policy(PPO.load(zip_file, device="cpu"), PREDATORS)
    arena = Arena(ENV, 16, 0)
    one, again = (arena.meet(policy, "predators", ScriptedTeams("flee_nearest")) for _ in range(2))
    assert one.fitness.tolist() == again.fitness.tolist()
    assert (one.steps <= 150).all()


# The tutorial, and the scripts that learn.


def block(name: str) -> str:
    """What docs/tutorial.md shows under a mark."""
    text = (ROOT / "docs" / "tutorial.md").read_text()
    found = re.search(rf"<!-- tutorial: {re.escape(name)} -->\n```\w+\n(.*?)```", text, re.DOTALL)
    assert found is not None, name
    return found[1]


def test_the_tutorial_shows_the_example() -> None:
    assert block("sb3_pond.py") == (ROOT / "examples/sb3_pond.py").read_text()


def test_the_tutorial_ends_on_a_leaderboard_and_at_a_best_response(tmp_path: Path) -> None:
    """Its commands, with the example in its quick form, fewer episodes and a smaller torus to solve."""

    def run(command: str) -> str:
        command = f"PATH={Path(sys.executable).parent}:$PATH {command.replace('examples/', f'{ROOT}/examples/')}"
        done = subprocess.run(["bash", "-c", command], cwd=tmp_path, check=True, timeout=PATIENCE, capture_output=True)
        return done.stdout.decode()

    assert block("train").strip() == "python examples/sb3_pond.py"
    quick, exploit = block("exploit").splitlines()
    caught = re.findall(r"(\d\.\d\d) of the prey caught", run(quick))
    assert len(caught) == 1 + 2
    assert float(caught[-1]) > float(caught[0]), "the best script comes first"
    assert (tmp_path / "pond-8x8.gif").stat().st_size > 1000
    run(block("measure").strip().replace("pond.zip", "pond-8x8.zip") + " --episodes 8")
    board = (tmp_path / "leaderboard.md").read_text()
    assert re.search(r"^\| my-agent \| 0\.\d{3} \|", board, re.MULTILINE)
    assert "esp-trainer benchmark --policy sb3:PPO:pond-8x8.zip --role predators --task pond" in board
    assert (tmp_path / "benchmarks/my-agent-predators-pond/scores.png").exists()
    assert "exploitability: 0." in run(exploit.replace("--size 8", "--size 4 --steps 3"))


def script(name: str, *options: object) -> None:
    command = [sys.executable, str(SCRIPTS / name), *map(str, options)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=PATIENCE)
    assert done.returncode == 0, done.stderr


def train_ppo(place: Path, *options: object) -> list[str]:
    """The files that a small training leaves."""
    script("train_ppo.py", *options, "--n-worlds", 4, "--steps", 10_000, "--out", place)
    return sorted(file.name for file in place.glob("*.safetensors"))


def test_ppo_learns_one_side_the_same_from_the_same_seed(tmp_path: Path) -> None:
    options = (
        "predators",
        "--task",
        "3v1",
        "--opponents",
        "flee_nearest",
        "paper-3v1/prey/seed-500-early",
        "--seed",
        3,
    )
    files = train_ppo(tmp_path / "one", *options)
    assert train_ppo(tmp_path / "again", *options) == files
    assert files[-1] == "predators-10.safetensors"
    assert any(file.name.startswith("events.") for file in (tmp_path / "one").iterdir()), "TensorBoard's"
    for file in files:
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "again" / file).read_bytes()
    first, last = (Team.load(tmp_path / "one" / file) for file in (files[0], files[-1]))
    assert not np.array_equal(first.genomes, last.genomes)
    assert last.provenance["opponents"] == ["flee_nearest", "paper-3v1/prey/seed-500-early"]


def test_ppo_plays_against_itself(tmp_path: Path) -> None:
    files = train_ppo(tmp_path, "both", "--reward", "terminal")
    assert files[0].startswith("predators-")
    assert files[-1] == "prey-10.safetensors"


def test_a_policy_of_ppo_and_the_team_that_it_is_saved_as_draw_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    """The chances of the network in PyTorch, against how often the team takes each action."""
    monkeypatch.syspath_prepend(SCRIPTS)
    from ppo.networks import Actor

    torch.manual_seed(0)
    policy = Actor(4, 3, 5, 16)
    with torch.no_grad():
        for parameter in policy.parameters():
            parameter.normal_(0, 0.7)
    team = policy.as_team("predators", WORLDS["3v2"], {})
    seen = np.array([[3, -2, 10, 5], [0, 1, -7, 2], [-20, 4, 1, 1]], np.float32)
    chances = policy(torch.from_numpy(seen)).softmax(-1).detach().numpy()
    counts = np.zeros((3, 5))
    team.reset(0)
    for _ in range(8000):
        actions = team.act({f"predator_{i}": row for i, row in enumerate(seen)})
        counts[range(3), list(actions.values())] += 1
    np.testing.assert_allclose(counts / 8000, chances, atol=0.02)


@pytest.mark.slow
def test_learners_are_compared_and_reported(tmp_path: Path) -> None:
    script("compare_learners.py", "--quick", "--runs", tmp_path / "runs", "--out", tmp_path / "out")
    page = (tmp_path / "out/benchmark.md").read_text()
    assert "nan" not in re.findall(r"[a-z]+", page)
    for name in ("ppo", "ppo, terminal", "ppo, self-play", "paper, longer", "modern", "answer", "intercept"):
        assert f"| `{name}` |" in page
    trained = {file: file.stat().st_mtime_ns for file in (tmp_path / "runs").rglob("*.safetensors")}
    script("compare_learners.py", "--quick", "--runs", tmp_path / "runs", "--out", tmp_path / "again")
    assert {file: file.stat().st_mtime_ns for file in (tmp_path / "runs").rglob("*.safetensors")} == trained
    script("compare_learners.py", "--report", "--out", tmp_path / "out")
    rows = [
        re.sub("^Made by.*", "", text, flags=re.MULTILINE)
        for text in (page, (tmp_path / "out/benchmark.md").read_text())
    ]
    assert rows[0] == rows[1]
