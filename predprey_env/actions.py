"""Checks of the actions that a caller passes in."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from operator import index
from typing import Any

_LONGEST = 100


def brief(value: Any) -> str:
    """Return a value's ``repr`` for an error message: on one line and at most about 100 characters long."""
    text = " ".join(repr(value).split())
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def check_agents(actions: Any, known: Collection[str]) -> None:
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
