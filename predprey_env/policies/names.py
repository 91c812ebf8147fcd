"""Names of the scripts, and of the agents of a team."""

from __future__ import annotations

from typing import Literal, TypeAlias, get_args

from predprey_env.config import TeamName

PredatorScript: TypeAlias = Literal["random", "greedy_chase", "parity_chase", "intercept", "surround"]
PreyScript: TypeAlias = Literal["random", "flee_nearest", "flee_centroid", "run_straight"]

SCRIPTS: dict[TeamName, tuple[str, ...]] = {"predators": get_args(PredatorScript), "prey": get_args(PreyScript)}
"""Names of the scripts that each team can play."""

PREFIXES: dict[TeamName, str] = {"predators": "predator_", "prey": "prey_"}
"""Beginnings of the names of each team's agents; a name ends in the agent's number."""


def other_team(team: TeamName) -> TeamName:
    """Return the opposing team."""
    return "prey" if team == "predators" else "predators"


def agent_number(agent: str) -> int:
    """Return the number at the end of an agent's name; raise :class:`ValueError` if there is none."""
    number = agent.rpartition("_")[2]
    if not number.isdecimal():
        raise ValueError(f"{agent} must end in an underscore and the agent's number")
    return int(number)
