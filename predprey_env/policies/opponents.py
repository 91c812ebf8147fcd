"""Whoever plays the other team: named, given as a policy, or as a function."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeAlias

import numpy as np

from predprey_env.actions import brief, read_action
from predprey_env.config import EnvConfig, TeamName
from predprey_env.policies.protocol import Policy
from predprey_env.policies.scripted import ScriptedTeam

Function: TypeAlias = Callable[[dict[str, np.ndarray]], Mapping[str, int]]
Opponent: TypeAlias = str | Policy | Function
"""The name of a script, a policy, or a function from observations to actions, by agent."""


class FunctionPolicy:
    """A function that remembers nothing, as a policy."""

    def __init__(self, function: Function) -> None:
        self._function = function

    def reset(self, seed: int | None = None) -> None:
        """Nothing to forget."""

    def act(self, observations: dict[str, np.ndarray]) -> Mapping[str, int]:
        """What the function says."""
        return self._function(observations)


def as_policy(opponent: Opponent, team: TeamName, env: EnvConfig) -> Policy:
    """The policy that plays a team; :class:`ValueError` for what cannot be one."""
    if isinstance(opponent, str):
        return ScriptedTeam.of(opponent, team, env)
    if isinstance(opponent, Policy) and not isinstance(opponent, type):
        if hasattr(opponent, "compiled"):
            opponent.compiled(team, env, 0)  # or it does not fit
        return opponent
    if callable(opponent) and not isinstance(opponent, type):
        return FunctionPolicy(opponent)
    raise ValueError(
        "opponent must be the name of a script, a policy with reset(seed) and act(observations), or a function of the "
        f"observations, got {brief(opponent)}"
    )


def draw_seed(generator: np.random.Generator) -> int:
    """What a policy is reset with in an episode; drawn from the environment's generator after the places."""
    return int(generator.integers(2**31))


def ask(
    policy: Policy, observations: dict[str, np.ndarray], n_actions: int, whose: str = "the opponent's"
) -> dict[str, int]:
    """The policy's actions, checked; ``whose`` act() it is stands in errors.

    Raises :class:`RuntimeError` from what it raised, :class:`ValueError` if what it returned is not an action for each
    agent.
    """
    try:
        actions = policy.act(observations)
    except (Exception, SystemExit) as error:
        raise RuntimeError(f"{whose} act() raised {type(error).__name__}: {error}") from error
    if not isinstance(actions, Mapping):
        raise ValueError(f"{whose} act() must return a mapping from agents to actions, got {brief(actions)}")
    try:
        return {agent: read_action(actions, agent, n_actions) for agent in observations}
    except ValueError as error:
        raise ValueError(f"{whose} act() must return an action for each agent: {error}") from None
