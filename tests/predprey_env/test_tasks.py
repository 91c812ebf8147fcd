"""Named worlds, in every form of the environment."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium
import pettingzoo
import pytest

from esp_trainer import WORLDS
from predprey_env import TASKS, EnvConfig, joint_env, parallel_env, parallel_vector_env, team_view, vector_env
from predprey_env.policies import ScriptedTeam
from predprey_env.predprey_v0 import env

NAMED = pytest.mark.parametrize("task", TASKS)
MAKERS: dict[str, Callable[..., Any]] = {
    "parallel_env": lambda **how: parallel_env(**how),
    "env": lambda **how: env(**how).unwrapped,
    "team_view": lambda **how: team_view("prey", **how),
    "joint_env": lambda **how: joint_env("prey", **how),
    "vector_env": lambda **how: vector_env(2, **how),
    "parallel_vector_env": lambda **how: parallel_vector_env(num_envs=2, **how),
    "gymnasium.make": lambda task, **how: gymnasium.make(f"predprey/{task.capitalize()}-Predators-v0", **how).unwrapped,
    "gymnasium.make_vec": lambda task, **how: (
        gymnasium.make_vec(
            f"predprey/{task.capitalize()}-Prey-v0", num_envs=2, vectorization_mode="vector_entry_point", **how
        ).unwrapped
    ),
}
MADE = pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)


def test_the_tasks_are_what_they_were() -> None:
    """A name's world never changes."""
    assert {name: task.world.changes for name, task in TASKS.items()} == {
        "pond": "n_prey=1, size=20, max_cycles=60, reward=dense",
        "meadow": "size=30, max_cycles=90, reward=dense",
        "steppe": "size=40, reward=dense",
        "3v1": "n_prey=1, reward=dense",
        "3v2": "reward=dense",
    }
    assert {name: env.replace(reward="dense") for name, env in WORLDS.items()} == {
        name: task.world for name, task in TASKS.items()
    }
    assert (WORLDS["3v2"], WORLDS["3v1"]) == (EnvConfig(), EnvConfig(n_prey=1))


@NAMED
@MADE
def test_every_form_of_the_environment_knows_the_tasks(make: Callable[..., Any], task: str) -> None:
    assert make(task=task).config == TASKS[task].world
    assert make(task=task, max_cycles=9, see_moves=True).config == TASKS[task].world.replace(
        max_cycles=9, see_moves=True
    )


@pytest.mark.skipif(not hasattr(pettingzoo, "make"), reason="PettingZoo before 1.27 has no registry")
@NAMED
def test_pettingzoo_knows_the_tasks(task: str) -> None:
    assert pettingzoo.make("parallel", f"predprey-{task}-v0").unwrapped.config == TASKS[task].world
    assert pettingzoo.make("aec", f"predprey-{task}-v0").unwrapped.config == TASKS[task].world


@MADE
def test_an_unknown_task_is_refused_with_the_nearest_name(make: Callable[..., Any]) -> None:
    if make not in (MAKERS["gymnasium.make"], MAKERS["gymnasium.make_vec"]):
        with pytest.raises(ValueError, match=r"^task must be one of pond, .*, got 'meadows'; did you mean meadow\?$"):
            make(task="meadows")


def test_without_an_opponent_a_script_plays() -> None:
    for made in (vector_env(2, "predators"), team_view("predators", task="pond"), vector_env(num_envs=2)):
        assert isinstance(made.opponent, ScriptedTeam)
        assert made.opponent.script == "flee_nearest"
    assert team_view("prey").opponent.script == "surround"  # type: ignore[union-attr]


@pytest.mark.parametrize(("given", "got"), [({}, "neither"), ({"n_worlds": 2, "num_envs": 2}, "2 and 2")])
@pytest.mark.parametrize("make", [vector_env, parallel_vector_env])
def test_the_number_of_worlds_is_given_once(make: Callable[..., Any], given: dict[str, int], got: str) -> None:
    with pytest.raises(
        ValueError, match=f"^n_worlds or num_envs, its other name, must be given, but not both, got {got}$"
    ):
        make(**given)
    assert make(num_envs=3).n_worlds == make(3).n_worlds == 3
