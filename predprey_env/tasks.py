"""Named worlds, from easy to hard, in which policies are trained and compared."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from typing import Any, NamedTuple

from predprey_env.config import EnvConfig, TeamName
from predprey_env.policies.pool import Opponents


class Task(NamedTuple):
    """A world with a name."""

    world: EnvConfig
    about: str
    """The purpose of the task, in one line."""


def _world(**parameters: Any) -> EnvConfig:
    """Return a world with dense rewards, for RL. The return is the change in the paper's fitness over the episode."""
    return EnvConfig(reward="dense", **parameters)


TASKS: dict[str, Task] = {
    "pond": Task(_world(n_prey=1, size=20, max_cycles=60), "one prey on a small torus, which PPO learns in seconds"),
    "meadow": Task(_world(size=30, max_cycles=90), "two prey, which scripts hardly catch and PPO learns in minutes"),
    "steppe": Task(_world(size=40), "two prey, where the lead changes when both teams learn"),
    "3v1": Task(_world(n_prey=1), "the paper's world with one prey"),
    "3v2": Task(_world(), "the paper's world with two prey, in which prey win"),
}
"""Name -> task. The world of a name never changes; a better world gets a new name."""

DEFAULT_OPPONENTS = {"predators": "flee_nearest", "prey": "surround"}
"""Script that a team plays against by default."""


def world(task: str | None, parameters: Mapping[str, Any]) -> EnvConfig:
    """Return the world of a task, or the default world if ``task`` is None, with some fields changed.

    Raises :class:`ValueError` for an unknown task; the message holds the nearest known name.
    """
    if task is None:
        return EnvConfig(**parameters)
    if task not in TASKS:
        near = difflib.get_close_matches(str(task), TASKS, n=1)
        hint = f"; did you mean {near[0]}?" if near else ""
        raise ValueError(f"task must be one of {', '.join(TASKS)}, got {task!r}{hint}")
    return TASKS[task].world.replace(**parameters)


def or_default(opponent: Opponents | None, team: TeamName) -> Opponents:
    """Return the opponent, or a team's default opponent if it is None."""
    return DEFAULT_OPPONENTS.get(team, "random") if opponent is None else opponent
