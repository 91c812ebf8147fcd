"""Opponents of a trained team: the name of a script, a policy, or a function."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from inspect import signature
from typing import Any, TypeAlias

import numpy as np

from predprey_env.agents import read_action
from predprey_env.arrays import Observations
from predprey_env.config import EnvConfig, TeamName
from predprey_env.policies.protocol import Player, Policy, choose
from predprey_env.policies.scripted import ScriptedTeam, how_to_load
from predprey_env.settings import brief, error_line
from predprey_env.sight import AnySight, observe

PolicyFunction: TypeAlias = Callable[[Observations], Mapping[str, int]]
Opponent: TypeAlias = str | Policy | PolicyFunction
"""The name of a script, a policy, or a function from observations to actions, by agent."""


class FunctionPolicy:
    """A function without memory, as a policy."""

    def __init__(self, function: PolicyFunction) -> None:
        self._function = function

    def reset(self, seed: int | None = None) -> None:
        """Do nothing: a function has no memory."""

    def act(self, observations: Observations) -> Mapping[str, int]:
        """Return the actions that the function chooses."""
        return self._function(observations)


def as_policy(opponent: Opponent, team: TeamName, env: EnvConfig, named: str = "opponent") -> Policy:
    """Return an opponent as a policy; raise :class:`ValueError` if it cannot play the team in this world.

    Error messages call the opponent ``named``.
    """
    if isinstance(opponent, str):
        return ScriptedTeam.of(opponent, team, env)
    if isinstance(opponent, type):
        raise ValueError(f"{named} must be an object, got the class {opponent.__name__}: give {opponent.__name__}(...)")
    has = [name for name in _CALLS if callable(getattr(opponent, name, None))]
    missing = [_CALLS[name] for name in ("reset", "act") if name not in has]
    if not missing:
        for name in has:
            call = _CALLS[name]
            _check_call(getattr(opponent, name), call, f"{named}'s {name}() cannot be called as {call}")
        compiled_player(opponent, team, env, 0, named)  # type: ignore[arg-type] # raises if it does not fit the world
        return opponent  # type: ignore[return-value]
    if callable(opponent) and "act" not in has:
        _check_call(opponent, _CALLS["act"], f"{named} cannot be called with the observations alone")
        return FunctionPolicy(opponent)
    if has:
        there = " and ".join(f"{name}()" for name in has)
        raise ValueError(f"{named} has {there} but no {' and no '.join(missing)}")
    raise ValueError(
        f"{named} must be the name of a script, a policy with reset(seed) and act(observations), or a function of the "
        f"observations, got {brief(opponent)}{how_to_load(opponent)}"
    )


_CALLS = {
    "reset": "reset(seed)",
    "act": "act(observations)",
    "act_batch": "act_batch(observations)",
    "compiled": "compiled(team, env, lanes)",
}


def _check_call(function: Callable[..., Any], call: str, otherwise: str) -> None:
    """Raise :class:`ValueError` that begins with ``otherwise`` unless a function takes the arguments of a call."""
    try:
        called = signature(function)
    except (TypeError, ValueError):  # some built-in functions have no signature
        return
    try:
        called.bind(*call.split(","))
    except TypeError as error:
        raise ValueError(f"{otherwise}: {error}") from None


def compiled_player(
    policy: Policy, team: TeamName, env: EnvConfig, lanes: int, named: str = "opponent"
) -> Player | None:
    """Return a policy's player in compiled code, None if it has none; raise :class:`ValueError` if it cannot play.

    The player's class must itself have a rule, because Numba confuses two classes with the same name and fields.
    """
    compiled = getattr(policy, "compiled", None)
    if not callable(compiled):
        return None
    try:
        player = compiled(team, env, lanes)
    except ValueError:  # its message already says why the policy does not fit
        raise
    except (Exception, SystemExit) as error:
        raise ValueError(f"{named}'s compiled() raised {type(error).__name__}: {error}") from error
    if type(player) not in choose.registry:
        expected = "a player whose class has a rule: choose.register(Player, rule)"
        raise ValueError(f"{named}'s compiled() must return {expected}, got {brief(player)}")
    return player


def sight_in(policy: Policy, env: EnvConfig) -> AnySight:
    """Return what a policy observes in a world: its own attribute ``sight``, or the world's if it has none."""
    sight: AnySight = getattr(policy, "sight", env.sight)
    if type(sight) not in observe.registry:
        raise ValueError(f"a policy's sight must be a predprey_env.Sight or one of your own, got {brief(sight)}")
    return sight


def asked_at_once(policy: Policy) -> bool:
    """Return whether a policy chooses for many worlds in one call, ``act_batch``. Such a policy has no memory."""
    return callable(getattr(policy, "act_batch", None))


def own_copy(policy: Policy, whose: str = "the opponent's") -> Policy:
    """Return a copy of a policy, so that each world has its own memory.

    A function and a policy with ``act_batch`` have no memory, so they are returned uncopied. Raises
    :class:`ValueError` for a policy that cannot be copied.
    """
    if isinstance(policy, FunctionPolicy) or asked_at_once(policy):
        return policy
    try:
        return copy.deepcopy(policy)
    except Exception as error:
        raise ValueError(
            f"{whose} memory cannot be copied for each world: {error_line(error)}; give it a __deepcopy__(), or give a "
            "function that calls its act(), which all worlds share"
        ) from error


def draw_seed(generator: np.random.Generator) -> int:
    """Sample the seed with which a policy is reset in an episode.

    It is sampled from the environment's generator after the start positions.
    """
    return int(generator.integers(2**31))


def ask(policy: Policy, observations: Observations, n_actions: int, whose: str = "the opponent's") -> dict[str, int]:
    """Return the policy's actions, checked; error messages name the owner of its ``act()`` as ``whose``.

    Raises :class:`RuntimeError` if the policy raised an exception, and :class:`ValueError` if it did not return an
    action for each agent.
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
