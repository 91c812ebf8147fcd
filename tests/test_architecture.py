"""The arrows of the house: who may import whom."""

import ast
import doctest
import importlib
import re
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

import predprey_env

ROOT = Path(__file__).parent.parent

# A module may import what stands before it, and its own layer.
LAYERS = [
    ["arrays"],
    ["networks"],
    ["types"],
    ["game", "games"],
    ["config", "esp_config", "cores", "jobs", "processes", "seeding", "statistics", "files", "tasks"],
    ["presets", "algorithm"],
    ["esp"],
    ["algorithms"],
    ["teams"],
    ["coevolution"],
    ["run"],
    ["cluster"],
    ["evaluation"],
    ["analysis", "exact"],
    ["benchmark", "report", "sweep"],
    ["cli"],
]
RANK = {name: rank for rank, layer in enumerate(LAYERS) for name in layer}

# The world beyond its config, the tools that rules are written with, and what is asked of those who play in it.
SEES_THE_WORLD = {"evaluation", "analysis", "exact", "benchmark", "report", "cli"}
NOT_THE_WORLD = {"arrays", "config", "extras", "settings", "agents", "jit", "plugins", "policies", "sight", "tasks"}

# Likewise for the environment: each room may import those before it.
ROOMS = [
    "arrays",
    "settings",
    "extras",
    "plugins",
    "jit",
    "sight",
    "config",
    "agents",
    "rules",
    "policies",
    "tasks",
    "engine",
    "rendering",
    "envs",
    "predprey_v0",
    "sb3",
]


def modules(package: str) -> list[Path]:
    return sorted((ROOT / package).rglob("*.py"))


def imports(path: Path) -> set[str]:
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path} imports relatively"
            assert node.module is not None
            found |= {node.module} if "." in node.module else {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def part(module: str) -> str:
    return module.split(".")[1] if "." in module else ""


@pytest.mark.parametrize("path", modules("predprey_env"), ids=str)
def test_the_world_knows_nothing_of_evolution(path: Path) -> None:
    assert not any(name.startswith("esp_trainer") for name in imports(path))


@pytest.mark.parametrize("path", modules("predprey_env"), ids=str)
def test_imports_inside_the_environment_point_one_way(path: Path) -> None:
    own = path.relative_to(ROOT / "predprey_env").parts[0].removesuffix(".py")
    if own == "__init__":
        return
    assert own in ROOMS, f"{own} has no place among the rooms"
    for name in imports(path):
        if name.startswith("predprey_env."):
            assert ROOMS.index(part(name)) <= ROOMS.index(own), f"{path} imports {name}"


@pytest.mark.parametrize("path", modules("esp_trainer"), ids=str)
def test_imports_inside_the_trainer_point_one_way(path: Path) -> None:
    own = path.relative_to(ROOT / "esp_trainer").parts[0].removesuffix(".py")
    if own in ("__init__", "__main__"):
        return
    assert own in RANK, f"{own} has no place in the layers"
    for name in imports(path):
        if name.startswith("esp_trainer."):
            assert RANK[part(name)] <= RANK[own], f"{path} imports {name}"


@pytest.mark.parametrize("path", modules("esp_trainer"), ids=str)
def test_only_those_who_play_see_the_world(path: Path) -> None:
    own = path.relative_to(ROOT / "esp_trainer").parts[0].removesuffix(".py")
    seen = {part(name) for name in imports(path) if name.startswith("predprey_env")}
    assert own in SEES_THE_WORLD or seen <= NOT_THE_WORLD


@pytest.mark.parametrize("path", [*modules("predprey_env"), *modules("esp_trainer")], ids=str)
def test_no_file_outgrows_its_purpose(path: Path) -> None:
    assert len(path.read_text().splitlines()) <= 320


@pytest.mark.parametrize("path", [*modules("predprey_env"), *modules("esp_trainer")], ids=str)
def test_no_function_hides_a_module(path: Path) -> None:
    if path.stem == "__main__":  # it runs when it is imported
        return
    name = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
    if name == "predprey_env.sb3":
        pytest.importorskip("stable_baselines3")
    module = importlib.import_module(name)
    parent, _, own = name.rpartition(".")
    assert not parent or getattr(sys.modules[parent], own) is module


def test_the_version_is_stated_once() -> None:
    stated = re.findall(r'"\d+\.\d+\.\d+"', (ROOT / "pyproject.toml").read_text())
    assert stated == []
    assert version("predprey-esp") == predprey_env.__version__


@pytest.mark.parametrize("package", ["predprey_env", "esp_trainer"])
def test_the_examples_of_a_package_run(package: str) -> None:
    done = doctest.testmod(importlib.import_module(package))
    assert (done.failed, done.attempted > 0) == (0, True)
