"""Names of the agents, and checks of the actions that callers pass for them."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from operator import index
from typing import Any

from predprey_env.config import TeamName
from predprey_env.settings import brief

PREFIXES: dict[TeamName, str] = {"predators": "predator_", "prey": "prey_"}
"""Prefix of the agents' names of each team; the agent's index in its team follows."""


def other_team(team: TeamName) -> TeamName:
    """Return the opposing team."""
    return "prey" if team == "predators" else "predators"


def agent_number(agent: str) -> int:
    """Return the number at the end of an agent's name; raise :class:`ValueError` if there is none."""
    number = agent.rpartition("_")[2]
    if not number.isdecimal():
        raise ValueError(f"{agent} must end in an underscore and the agent's number")
    return int(number)


def check_agents(actions: object, known: Collection[str]) -> None:
    """Raise :class:`ValueError` unless actions are a mapping from known agents."""
    if not isinstance(actions, Mapping):
        raise ValueError(f"actions must be a mapping from agents to actions, got {brief(actions)}")
    for agent in actions:
        if agent not in known:
            raise ValueError(f"actions must be for {', '.join(known)}, got one for {agent!r}")


def read_action(actions: Mapping[str, Any], agent: str, n_actions: int) -> int:
    """Return an agent's action; raise :class:`ValueError` if it is missing, not an integer or out of range."""
    try:
        action = index(actions[agent])
    except KeyError:
        raise ValueError(f"an action for {agent} is missing; got actions for {brief(list(actions))}") from None
    except TypeError:
        raise ValueError(f"the action of {agent} must be an integer, got {brief(actions[agent])}") from None
    if not 0 <= action < n_actions:
        raise ValueError(f"the action of {agent} must be in 0..{n_actions - 1}, got {action}")
    return action
