"""Scripted teams: baselines to evolve, train and compare against. They see only what the agents see.

The choices are compiled rules over values, so that they play in one world or in a block of them.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from predprey_env.compilation import entry_point, rule
from predprey_env.lanes import load, where
from predprey_env.torus import magnitude, manhattan

SCRIPTS: dict[str, int] = {"greedy_chase": 1, "flee_nearest": 2}
"""Names of the scripted policies, and their numbers in compiled code."""

ROLES: dict[str, Literal["predators", "prey"]] = {"greedy_chase": "predators", "flee_nearest": "prey"}
"""Which team each can play."""

GREEDY_CHASE = SCRIPTS["greedy_chase"]
_FAR = 1 << 20


@rule
def _nearest(seen: Any, n_opponents: int) -> Any:
    """The offset ``(dx, dy)`` of the nearest opponent, and its distance; those at (0, 0) are caught and passed over."""
    nearest_x, nearest_y = load(seen, 0), load(seen, 1)
    length = manhattan(nearest_x, nearest_y)
    nearest = where(length == 0, length + _FAR, length)
    for opponent in range(1, n_opponents):
        dx, dy = load(seen, 2 * opponent), load(seen, 2 * opponent + 1)
        length = manhattan(dx, dy)
        closer = (length < nearest) & (length > 0)
        nearest_x, nearest_y = where(closer, dx, nearest_x), where(closer, dy, nearest_y)
        nearest = where(closer, length, nearest)
    return nearest_x, nearest_y, nearest


@rule
def _towards(dx: Any, dy: Any) -> Any:
    """The move that shortens the longer leg of an offset; the x leg where they tie."""
    return where(magnitude(dx) >= magnitude(dy), where(dx > 0, 0, 1), where(dy > 0, 2, 3))


@rule
def greedy_chase(seen: Any, n_opponents: int, n_actions: int) -> Any:
    """A predator that runs straight at the nearest free prey, and idles, if it may, when none is left."""
    dx, dy, length = _nearest(seen, n_opponents)
    return where(length < _FAR, _towards(dx, dy), n_actions - 1)


@rule
def flee_nearest(seen: Any, n_opponents: int) -> Any:
    """The fixed prey of Yong & Miikkulainen: it runs straight away from the nearest predator."""
    dx, dy, _ = _nearest(seen, n_opponents)
    return _towards(0 - dx, 0 - dy)


@rule
def scripted(script: int, seen: Any, n_opponents: int, n_actions: int) -> Any:
    """The action of the scripted policy of a number in :data:`SCRIPTS`."""
    if script == GREEDY_CHASE:
        return greedy_chase(seen, n_opponents, n_actions)
    return flee_nearest(seen, n_opponents)


@entry_point
def _act(script: int, seen: Any, n_opponents: int, n_actions: int) -> int:
    return scripted(script, seen, n_opponents, n_actions)  # type: ignore[no-any-return]


class ScriptedTeam:
    """A team in which every agent follows the same script.

    Meets the policy protocol: ``reset(seed)``, ``act(observations) -> actions``.
    """

    def __init__(self, script: str, n_actions: int) -> None:
        if script not in SCRIPTS:
            raise ValueError(f"script must be one of {', '.join(SCRIPTS)}, got {script!r}")
        self.script = script
        self.n_actions = n_actions

    def reset(self, seed: int | None = None) -> None:
        """Nothing to forget, and nothing random."""

    def act(self, observations: dict[str, np.ndarray]) -> dict[str, int]:
        """An action for each agent that has an observation; the other team's are passed over."""
        number, other = SCRIPTS[self.script], "predator_" if ROLES[self.script] == "prey" else "prey_"
        return {
            agent: int(_act(number, seen, len(seen) // 2, self.n_actions))
            for agent, seen in observations.items()
            if not agent.startswith(other)
        }
