"""Who a SPEC names, and what is said of one that names nobody."""

from __future__ import annotations

import hashlib
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from esp_trainer import Team, load_team
from esp_trainer.benchmark.batched import TorchPolicy
from esp_trainer.benchmark.specs import load_candidate
from esp_trainer.tasks import WORLDS
from esp_trainer.teams.zoo import known_teams
from esp_trainer.types import PolicyError, ScriptedTeams

ENV = WORLDS["3v2"]
PREDATORS = next(name for name, t in known_teams().items() if (t.task, t.role) == ("3v2", "predators"))
VIEWS = {f"predator_{i}": np.full(4, i, np.float32) for i in range(3)}
MODULE = """
def east(observations):
    return dict.fromkeys(observations, 0)

class Idle:
    def reset(self, seed=None): pass
    def act(self, observations): return dict.fromkeys(observations, 4)

class Needy:
    def __init__(self, path): pass

idle = Idle()

def make():
    return idle

def fails():
    raise RuntimeError("no\\nluck")

number = 3
"""


@pytest.fixture(autouse=True)
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A directory with modules of one's own."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", sys.path[:])
    (tmp_path / "my_policies.py").write_text(MODULE)
    (tmp_path / "broken_policies.py").write_text("raise ValueError('it is\\nbroken')")
    yield tmp_path
    for name in ("my_policies", "broken_policies"):
        sys.modules.pop(name, None)


def test_a_script():
    candidate = load_candidate("greedy_chase", "predators", ENV)
    assert candidate.player == ScriptedTeams("greedy_chase")
    assert (candidate.spec, candidate.digest, candidate.caution) == ("greedy_chase", "greedy_chase", "")


def test_a_team_of_the_zoo():
    candidate = load_candidate(PREDATORS, "predators", ENV)
    assert isinstance(candidate.player, Team)
    assert candidate.player.genomes.tolist() == load_team(PREDATORS).genomes.tolist()
    assert candidate.digest == known_teams()[PREDATORS].digest
    assert candidate.caution == ""


def test_a_teams_file(place: Path):
    load_team(PREDATORS).save(place / "mine.safetensors")
    candidate = load_candidate("mine.safetensors", "predators", ENV)
    assert isinstance(candidate.player, Team)
    assert candidate.digest == hashlib.sha256((place / "mine.safetensors").read_bytes()).hexdigest()


@pytest.mark.parametrize(("name", "action"), [("east", 0), ("Idle", 4), ("idle", 4), ("make", 4)])
def test_a_function_an_object_and_what_makes_one(name: str, action: int, place: Path):
    candidate = load_candidate(f"my_policies:{name}", "predators", ENV)
    player: Any = candidate.player
    assert player.act(VIEWS) == dict.fromkeys(VIEWS, action)
    assert candidate.caution == "my_policies was imported"
    assert candidate.digest == hashlib.sha256((place / "my_policies.py").read_bytes()).hexdigest()


NOT_FOUND = "cannot be imported: ModuleNotFoundError:"
NOBODY = {
    "greedy_chas": "unknown policy greedy_chas; did you mean greedy_chase or parity_chase?",
    "0": "unknown policy 0; nothing is named like it",
    "flee_nearest": "expected predators, got flee_nearest, a script of prey",
    "lost.safetensors": "lost.safetensors is not there",
    "sb3:PPO": "expected sb3:CLASS:FILE, such as sb3:PPO:model.zip, got 'sb3:PPO'",
    "sb3:PPO:lost.zip": "lost.zip is not there",
    "sb3:no_sb3.PPO:my_policies.py": f"no_sb3 {NOT_FOUND} No module named 'no_sb3'",
    "torch:nets:make": (
        "expected torch:MODULE:FUNCTION:FILE, such as torch:my_module:make_network:weights.pt, got 'torch:nets:make'"
    ),
    "torch:nets:make:lost.pt": "lost.pt is not there",
    "no_policies:make": f"no_policies {NOT_FOUND} No module named 'no_policies'",
    "broken_policies:make": "broken_policies cannot be imported: ValueError: it is",
    "my_policies:nobody": "my_policies has no nobody",
    "my_policies:fails": "my_policies:fails() raised RuntimeError: no",
    "my_policies:Needy": (
        "my_policies:Needy() raised TypeError: Needy.__init__() missing 1 required positional argument: 'path'"
    ),
    "my_policies:number": (
        "my_policies:number must be a policy with reset(seed) and act(observations), or a function of the "
        "observations, got 3"
    ),
}


@pytest.mark.parametrize("spec", NOBODY)
def test_a_spec_that_names_nobody_is_told_in_one_line(spec: str):
    with pytest.raises((PolicyError, FileNotFoundError)) as refused:
        load_candidate(spec, "predators", ENV)
    assert str(refused.value) == NOBODY[spec]


def test_only_what_has_chances_can_be_drawn():
    for spec in ("greedy_chase", PREDATORS, "my_policies:east"):
        with pytest.raises(PolicyError, match=f"^only policies of sb3: and torch: can be drawn, got {spec}: "):
            load_candidate(spec, "predators", ENV, drawn=True)


@pytest.mark.parametrize(("role", "task"), [("prey", "3v2"), ("predators", "3v1")])
def test_a_team_that_does_not_fit_is_refused(role: Any, task: str):
    with pytest.raises(ValueError, match=r"^expected prey, got a team of predators$|evolved against 2$"):
        load_candidate(PREDATORS, role, WORLDS[task])


@pytest.mark.parametrize("content", [b"", b"import os", b"\x80\x04.", b"\x08\x00\x00\x00\x00\x00\x00\x00{}      "])
def test_a_foreign_file_is_refused_and_not_run(content: bytes, place: Path):
    (place / "foreign.safetensors").write_bytes(content)
    with pytest.raises(ValueError, match=r"^foreign\.safetensors (is damaged: .+|was not written by esp_trainer)$"):
        load_candidate("foreign.safetensors", "predators", ENV)


# Libraries that are not here, by stand-ins.


SB3 = """
import gymnasium
import numpy as np

class PPO:
    observation_space = gymnasium.spaces.Box(-50, 49, (4,))
    action_space = gymnasium.spaces.Discrete(5)

    @classmethod
    def load(cls, path, device):
        assert device == "cpu"
        if path.read_bytes() != b"weights":
            raise ValueError("it is\\nno model")
        return cls()

    def predict(self, rows, deterministic):
        return rows[:, 0].astype(int), None

class Wide(PPO):
    observation_space = gymnasium.spaces.Box(-np.linspace(1, 2, 60), np.linspace(1, 2, 60), dtype=float)
"""


@pytest.fixture
def sb3(place: Path) -> Iterator[Path]:
    """A package like Stable-Baselines3, a model that it can load and one that it can't."""
    (place / "stand_in_sb3.py").write_text(SB3)
    (place / "model.zip").write_bytes(b"weights")
    (place / "other.zip").write_bytes(b"pictures")
    yield place
    sys.modules.pop("stand_in_sb3", None)


def test_a_model_is_told_to_have_been_unpickled(sb3: Path):
    candidate = load_candidate("sb3:stand_in_sb3.PPO:model.zip", "predators", ENV)
    player: Any = candidate.player
    assert player.act(VIEWS) == {"predator_0": 0, "predator_1": 1, "predator_2": 2}
    assert candidate.digest == hashlib.sha256(b"weights").hexdigest()
    assert candidate.caution == ("model.zip was unpickled by Stable-Baselines3, which runs what its author put there")


@pytest.mark.parametrize(
    ("spec", "line"),
    [
        (
            "sb3:stand_in_sb3.PPO:other.zip",
            "other.zip is not a model that stand_in_sb3.PPO of Stable-Baselines3 can load: ValueError: it is",
        ),
        ("sb3:stand_in_sb3.DQN:model.zip", "stand_in_sb3 has no DQN"),
        ("sb3:stand_in_sb3.Wide:model.zip", "the model must observe 4 numbers and have 5 actions, got Box("),
    ],
)
def test_a_model_that_cannot_be_used_is_told_in_one_line(spec: str, line: str, sb3: Path):
    with pytest.raises(ValueError, match=f"^{re.escape(line)}") as refused:
        load_candidate(spec, "predators", ENV)
    assert "\n" not in str(refused.value)


class Network:
    """A stand-in for a PyTorch module."""

    def eval(self) -> Network:
        return self

    def load_state_dict(self, weights: str) -> None:
        if weights != "weights":
            raise RuntimeError("other layers\nwere expected")


@pytest.fixture
def torch(place: Path, monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """How files of weights were read by a stand-in for PyTorch, with modules and weights to read."""
    asked: list[dict[str, Any]] = []

    def load(path: Path, **how: Any) -> str:
        asked.append(how)
        return path.read_text()

    monkeypatch.setitem(sys.modules, "torch", SimpleNamespace(load=load))
    monkeypatch.setitem(sys.modules, "my_networks", SimpleNamespace(make=Network, __name__="my_networks"))
    (place / "weights.pt").write_text("weights")
    (place / "others.pt").write_text("others")
    return asked


def test_weights_are_read_without_running_what_is_in_them(torch: list[dict[str, Any]], place: Path):
    candidate = load_candidate("torch:my_networks:make:weights.pt", "predators", ENV)
    assert torch == [{"map_location": "cpu", "weights_only": True}]
    assert isinstance(candidate.player, TorchPolicy)
    assert candidate.digest == hashlib.sha256(b"weights").hexdigest()
    assert candidate.caution == "my_networks was imported"


@pytest.mark.usefixtures("torch")
def test_weights_of_another_network_are_told_in_one_line():
    with pytest.raises(PolicyError) as refused:
        load_candidate("torch:my_networks:make:others.pt", "predators", ENV)
    assert str(refused.value) == "others.pt does not hold weights for my_networks:make: RuntimeError: other layers"


def test_a_library_that_is_not_installed_is_told(place: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "torch", None)
    (place / "weights.pt").write_text("weights")
    with pytest.raises(PolicyError, match=r"^torch cannot be imported: ModuleNotFoundError: [^\n]+$"):
        load_candidate("torch:my_policies:make:weights.pt", "predators", ENV)


@pytest.mark.parametrize("module", ["import sys; sys.exit(0)", "raise SystemExit('usage: me')"])
def test_a_module_that_ends_the_process_is_told(module: str, place: Path):
    """Such as a script of training without a guard; else the benchmark ends with its exit code, and no table."""
    (place / "broken_policies.py").write_text(module)
    with pytest.raises(PolicyError, match=r"^broken_policies cannot be imported: SystemExit"):
        load_candidate("broken_policies:make", "predators", ENV)


@pytest.mark.parametrize("spec", ["sb3:", "torch:", "torch:::", "sb3::"])
def test_a_spec_without_its_parts_says_what_they_are(spec: str):
    with pytest.raises(PolicyError, match=f"^expected {spec.split(':')[0]}:"):
        load_candidate(spec, "predators", ENV)
