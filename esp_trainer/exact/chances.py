"""A policy's action probabilities in every state of a small torus.

A policy may treat agents differently, so equivalent states are not merged: states are ordered by their keys
(:mod:`esp_trainer.exact.states`). First come those in which only the first prey is free, then those with only the
second, then those with both, and so on, as binary numbers count up.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import singledispatch
from itertools import compress
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from esp_trainer.arrays import ActionProbabilities
from esp_trainer.esp.network import Networks, accumulate, agent_votes, most_votes
from esp_trainer.esp.team import Team
from esp_trainer.exact.states import n_keys, read_key
from esp_trainer.types import PolicyError, Role, ScriptedTeams
from predprey_env.agents import PREFIXES
from predprey_env.arrays import Actions, Observation, Observations
from predprey_env.config import EnvConfig, Rules
from predprey_env.jit.compilation import entry_point
from predprey_env.policies import ScriptedTeam
from predprey_env.policies.opponents import ask, sight_in
from predprey_env.policies.outside import OutsideTeam
from predprey_env.policies.protocol import MEMORY
from predprey_env.policies.scripted import Script, follow
from predprey_env.rules.dynamics import World
from predprey_env.rules.observation import observe
from predprey_env.settings import brief
from predprey_env.sight import PLAIN_SIGHT, AnySight

_TOGETHER = 1 << 10  # number of states per call of a policy: few enough to show progress
_ASKED_AGAIN = 500  # number of states in which a policy is asked twice, to check that it always acts the same


Progress: TypeAlias = Callable[[int], object]


def _unseen(n: int) -> None:
    """Show no progress."""


class Survivors(NamedTuple):
    """A subset of surviving prey and its slice of states."""

    prey: tuple[int, ...]
    keys: slice


def survivors(config: EnvConfig) -> list[Survivors]:
    """Return all subsets of surviving prey, in the order of their states."""
    found, end = [], 0
    for bits in range(1, 2**config.n_prey):
        prey = tuple(compress(range(config.n_prey), (bits >> i & 1 for i in range(config.n_prey))))
        begin, end = end, end + n_keys(config.size, config.n_predators, len(prey))
        found.append(Survivors(prey, slice(begin, end)))
    return found


def views(config: EnvConfig, role: Role, sight: AnySight = PLAIN_SIGHT) -> Observation:
    """Return what every agent of a team observes in every state: float32 ``(n_states, n_agents, n_seen)``.

    Raises :class:`PolicyError` if the last moves are observed, which no state holds. A sight that does not say whether
    it reads them counts as one that does.
    """
    if getattr(sight, "moves", True):
        raise PolicyError("a policy that observes the last moves cannot be solved for: positions do not hold them")
    shape, n_agents, games = config.team(role), config.n_agents, survivors(config)
    n_seen = sight.n_seen(shape.n_agents, shape.n_opponents)
    seen = np.zeros((games[-1].keys.stop, shape.n_agents, n_seen), np.float32)
    first = 0 if role == "predators" else config.n_predators
    for prey, keys in games:
        alive = np.isin(range(config.n_prey), prey).astype(np.int32)
        world = World(np.zeros(n_agents, np.int32), np.zeros(n_agents, np.int32), alive)
        rows = np.array([*range(config.n_predators), *(config.n_predators + i for i in prey)])
        _look(world, config.rules, sight, first, rows, np.zeros(len(rows), np.int32), seen[keys])
    return seen


@entry_point
def _look(world: World, rules: Rules, sight: AnySight, first: int, rows: Any, cells: Any, seen: Any) -> None:
    """Write the observations in every state with the same survivors to ``seen``; ``rows`` are the survivors' rows of
    the world.
    """
    for key in range(seen.shape[0]):
        read_key(key, rules.size * rules.size, rules.n_predators, cells)
        for i in range(len(rows)):
            world.x[rows[i]], world.y[rows[i]] = cells[i] // rules.size, cells[i] % rules.size
        for agent in range(seen.shape[1]):
            observe(sight, world, world.x, first + agent, rules, seen[key, agent], 0)  # no last moves are read


def chances(policy: Any, role: Role, config: EnvConfig, progress: Progress = _unseen) -> ActionProbabilities:
    """Return a policy's action probabilities in every state: float64 ``(n_states, n_agents, n_actions)``.

    The array has probabilities for caught prey too, which have no meaning.

    A policy must always act the same in a position, or return its probabilities from a method ``chances(observations)
    -> {agent: chances}``, or from ``chances_batch`` for many positions, which maps float32 ``(n, n_agents, n_seen)`` to
    ``(n, n_agents, n_actions)``. If it has an attribute ``drawn`` that is false, it takes the most likely action
    although it has these methods. A policy that has memory or samples without returning probabilities, that raises, or
    that returns anything else leads to a :class:`~esp_trainer.types.PolicyError`, in one line.

    Args:
        policy: Policy that follows the policy protocol.
        role: Team that it plays.
        config: The world.
        progress: Called with the number of states in which the policy has just been asked.
    """
    seen = views(config, role, sight_in(policy, config))
    found = np.empty((*seen.shape[:2], config.team(role).n_actions))
    for first in range(0, len(seen), _TOGETHER):
        part = slice(first, first + _TOGETHER)
        found[part] = ask_in(policy, seen[part], role, config)
        progress(len(seen[part]))
    again = np.random.default_rng(0).choice(len(seen), min(_ASKED_AGAIN, len(seen)), replace=False)
    # The tolerance is wide because a network's probabilities depend slightly on the size of the batch.
    if not np.allclose(ask_in(policy, seen[again], role, config), found[again], atol=1e-3):
        raise PolicyError("the policy does not always do the same in a position: it remembers, or draws its actions")
    return found


@singledispatch
def ask_in(policy: Any, seen: Observation, role: Role, config: EnvConfig) -> ActionProbabilities:
    """Return :func:`chances` for the states in which the agents observe ``seen``, ``(n, n_agents, n_seen)``."""
    n_actions = config.team(role).n_actions
    if callable(_attribute(policy, "chances_batch")) and _attribute(policy, "drawn", True):
        return _checked(_batch_chances(policy, seen, n_actions), seen, role)
    if callable(_attribute(policy, "chances")):
        return _checked(np.array([_state_chances(policy, state, role, n_actions) for state in seen]), seen, role)
    return _certain(_actions(policy, seen, role, config), n_actions)


def _attribute(policy: Any, name: str, default: Any = None) -> Any:
    """Return an attribute of a policy; raise :class:`PolicyError` if reading it raises an exception."""
    try:
        return getattr(policy, name, default)
    except (Exception, SystemExit) as error:
        raise PolicyError(f"the policy's {name} cannot be read: {_named_error(error)}") from error


def _call(policy: Any, method: str, *arguments: Any) -> Any:
    """Call a method of the policy; convert any exception to a :class:`PolicyError`."""
    try:
        return _attribute(policy, method)(*arguments)
    except PolicyError:
        raise
    except (Exception, SystemExit) as error:
        raise PolicyError(f"the policy's {method}() raised {_named_error(error)}") from error


def _named_error(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}"


def _actions(policy: Any, states: Observation, role: Role, config: EnvConfig) -> Actions:
    """Return the policy's actions in some states, int ``(n_states, n_agents)``, asked and checked as in a match."""
    _call(policy, "reset", 0)
    try:
        if callable(_attribute(policy, "act_batch")):
            team = OutsideTeam(policy, config, role, len(states), whose="the policy's")
            team.views[:] = states
            return team.act(np.ones(len(states), np.bool_))
        n_actions = config.team(role).n_actions
        asked = (ask(policy, _named(state, role), n_actions, "the policy's") for state in states)
        return np.array([list(actions.values()) for actions in asked])
    except (RuntimeError, ValueError) as error:
        raise PolicyError(str(error)) from error
    except Exception as error:  # raised by the policy's own mapping type
        raise PolicyError(f"the policy's actions cannot be read: {_named_error(error)}") from error


def _batch_chances(policy: Any, states: Observation, n_actions: int) -> ActionProbabilities:
    shape = (*states.shape[:2], n_actions)
    answer = _call(policy, "chances_batch", states.copy())
    return _numbers(answer, shape, f"the policy must answer with an array of shape {shape}")


def _named(state: Observation, role: Role) -> Observations:
    return {f"{PREFIXES[role]}{i}": view for i, view in enumerate(state.copy())}


def _state_chances(policy: Any, state: Observation, role: Role, n_actions: int) -> ActionProbabilities:
    seen = _named(state, role)
    agents, answers = list(seen), _call(policy, "chances", seen)
    reason = ""
    if isinstance(answers, Mapping):
        try:
            listed = [answers[agent] for agent in agents]
            return _numbers(listed, (len(agents), n_actions), f"chances must be {n_actions} numbers for each agent")
        except PolicyError:
            raise
        except KeyError:
            pass
        except (Exception, SystemExit) as error:
            reason = f": {_named_error(error)}"
    raise PolicyError(f"the policy must answer for {', '.join(agents)}, got {brief(answers)}{reason}")


def _numbers(answer: Any, shape: tuple[int, ...], expected: str) -> ActionProbabilities:
    """Return an answer as float64 of a shape; raise :class:`PolicyError` if it has another shape or cannot be read."""
    reason = ""
    try:
        found = np.asarray(answer, float)
    except (Exception, SystemExit) as error:  # a tensor that requires a gradient, for example
        found, reason = np.empty(0), f": {_named_error(error)}"
    if found.shape != shape:
        raise PolicyError(f"{expected}, got {brief(answer)}{reason}")
    return found


def _checked(found: ActionProbabilities, seen: Observation, role: Role) -> ActionProbabilities:
    """Return the probabilities ``(n_states, n_agents, n_actions)``; raise :class:`PolicyError` for the first invalid
    ones.
    """
    totals = found.sum(axis=2)
    wrong = (found < 0).any(axis=2) | ~np.isclose(totals, 1, atol=1e-6)
    if wrong.any():
        state, agent = np.argwhere(wrong)[0]
        raise PolicyError(
            f"chances must be at least 0 and add up to 1, got {brief(found[state, agent].tolist())}, which add up to "
            f"{totals[state, agent]:.6g}, for {PREFIXES[role]}{agent} where it sees {seen[state, agent].tolist()}"
        )
    return found


def _certain(actions: Actions, n_actions: int) -> ActionProbabilities:
    return np.eye(n_actions)[actions]


@ask_in.register
def _(policy: Team, seen: Observation, role: Role, config: EnvConfig) -> ActionProbabilities:
    policy.check_fits(role, config)
    if policy.controller.remembers:
        raise PolicyError(
            f"{policy.side.network} networks have memory: their actions depend on earlier steps, so that "
            "exploitability is not defined"
        )
    found = np.zeros((*seen.shape[:2], config.team(role).n_actions))
    if policy.controller.n_together > 1:
        seen = np.repeat(seen.reshape(len(seen), 1, -1), seen.shape[1], axis=1)
    _team_chances(policy.networks(), np.ascontiguousarray(seen), np.zeros(MEMORY, np.int32), found)
    return found


@entry_point
def _team_chances(networks: Networks, seen: Any, memory: Any, out: Any) -> None:
    for state in range(out.shape[0]):
        for agent in range(out.shape[1]):
            agent_votes(networks, agent, seen[state, agent], memory, 0)
            if not networks.controller.draws:
                out[state, agent, most_votes(networks.controller, networks.votes)] = 1.0
                continue
            # accumulate() replaces the votes by the cumulative sums of their exponentials.
            total, before = float(accumulate(networks.controller, networks.votes)), 0.0
            for action in range(out.shape[2]):
                out[state, agent, action] = (networks.votes[action] - before) / total
                before = networks.votes[action]


@ask_in.register
def _(policy: ScriptedTeams, seen: Observation, role: Role, config: EnvConfig) -> ActionProbabilities:
    return ask_in(ScriptedTeam.of(policy.script, role, config), seen, role, config)


@ask_in.register
def _(policy: ScriptedTeam, seen: Observation, role: Role, config: EnvConfig) -> ActionProbabilities:
    script = policy.compiled(role, config, 0)
    shape = (*seen.shape[:2], script.n_actions)
    if policy.script == "random":
        return np.full(shape, 1 / script.n_actions)
    actions, memory = np.zeros(shape[:2], np.int64), np.zeros(MEMORY, np.int32)
    if not _script_actions(script, seen, actions, memory):
        raise PolicyError(f"{policy.script} has memory, so that its actions do not follow from the position")
    return _certain(actions, script.n_actions)


@entry_point
def _script_actions(script: Script, seen: Any, out: Any, memory: Any) -> bool:
    """Write the script's actions to ``out``, and return whether it left its memory empty."""
    for state in range(out.shape[0]):
        for agent in range(out.shape[1]):
            out[state, agent] = follow(script, agent, seen[state, agent], memory, 0)
            for row in range(len(memory)):
                if memory[row] != 0:
                    return False
    return True
