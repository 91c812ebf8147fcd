"""What a policy does in every state of a small torus: the chances of each agent's actions.

A policy may treat agents differently, so that nothing stands for what looks alike: states are by their keys
(:mod:`esp_trainer.exact.states`), those in which just the first prey is free, then just the second, then both, and so
on in the order of the bits of a number.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import singledispatch
from itertools import compress
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from esp_trainer.esp.network import Networks, accumulate, agent_votes, most_votes
from esp_trainer.esp.team import Team
from esp_trainer.exact.states import n_keys, read_key
from esp_trainer.types import PolicyError, Role, ScriptedTeams
from predprey_env.actions import brief
from predprey_env.compilation import entry_point
from predprey_env.config import EnvConfig, Rules
from predprey_env.dynamics import World
from predprey_env.observation import observe
from predprey_env.outside import OutsideTeam
from predprey_env.policies import ScriptedTeam
from predprey_env.policies.names import PREFIXES
from predprey_env.policies.opponents import ask
from predprey_env.policies.protocol import MEMORY
from predprey_env.policies.scripted import Script, follow

_TOGETHER = 1 << 10  # states that a policy is asked about at a time: few enough for progress to be seen
_ASKED_AGAIN = 500  # states, to see whether a policy is always of the same mind


Progress: TypeAlias = Callable[[int], object]


def _unseen(n: int) -> None:
    """Show no progress."""


class Survivors(NamedTuple):
    """Who may be left of the prey, and where the states are in which it is they."""

    prey: tuple[int, ...]
    keys: slice


def survivors(config: EnvConfig) -> list[Survivors]:
    """In the order of their states."""
    found, end = [], 0
    for bits in range(1, 2**config.n_prey):
        prey = tuple(compress(range(config.n_prey), (bits >> i & 1 for i in range(config.n_prey))))
        begin, end = end, end + n_keys(config.size, config.n_predators, len(prey))
        found.append(Survivors(prey, slice(begin, end)))
    return found


def views(config: EnvConfig, role: Role) -> np.ndarray:
    """What every agent of a team sees in every state: float32 ``(n_states, n_agents, n_seen)``."""
    shape, n_agents, games = config.team(role), config.n_agents, survivors(config)
    seen = np.zeros((games[-1].keys.stop, shape.n_agents, shape.n_seen), np.float32)
    first = 0 if role == "predators" else config.n_predators
    for prey, keys in games:
        alive = np.isin(range(config.n_prey), prey).astype(np.int32)
        world = World(np.zeros(n_agents, np.int32), np.zeros(n_agents, np.int32), alive)
        rows = np.array([*range(config.n_predators), *(config.n_predators + i for i in prey)])
        _look(world, config.rules, first, rows, np.zeros(len(rows), np.int32), seen[keys])
    return seen


@entry_point
def _look(world: World, rules: Rules, first: int, rows: Any, cells: Any, seen: Any) -> None:
    """``rows`` are those of the world for who is there."""
    for key in range(seen.shape[0]):
        read_key(key, rules.size * rules.size, rules.n_predators, cells)
        for i in range(len(rows)):
            world.x[rows[i]], world.y[rows[i]] = cells[i] // rules.size, cells[i] % rules.size
        for agent in range(seen.shape[1]):
            observe(world, first + agent, rules, seen[key, agent], 0)


def chances(policy: Any, role: Role, config: EnvConfig, progress: Progress = _unseen) -> np.ndarray:
    """The chances of each action of each agent of a team in every state, float64 ``(n_states, n_agents, n_actions)``.

    What it would do for caught prey is there too, and means nothing.

    A policy must do in a position what it always does there, or say its chances by a method
    ``chances(observations) -> {agent: chances}``, or ``chances_batch`` of many positions, from float32
    ``(n, n_agents, n_seen)`` to ``(n, n_agents, n_actions)``; an attribute ``drawn`` that is false says that it takes
    the most likely nevertheless. What remembers or draws otherwise, raises, or answers anything else is a
    :class:`~esp_trainer.types.PolicyError`, in one line.

    Args:
        policy: Meets the policy protocol.
        role: Which team it plays.
        config: The world.
        progress: Called with the number of states in which the policy has just been asked.
    """
    seen = views(config, role)
    found = np.empty((*seen.shape[:2], config.team(role).n_actions))
    for first in range(0, len(seen), _TOGETHER):
        part = slice(first, first + _TOGETHER)
        found[part] = ask_in(policy, seen[part], role, config)
        progress(len(seen[part]))
    again = np.random.default_rng(0).choice(len(seen), min(_ASKED_AGAIN, len(seen)), replace=False)
    # A network's probabilities depend a little on how many positions it is asked about at a time.
    if not np.allclose(ask_in(policy, seen[again], role, config), found[again], atol=1e-3):
        raise PolicyError("the policy does not always do the same in a position: it remembers, or draws its actions")
    return found


@singledispatch
def ask_in(policy: Any, seen: np.ndarray, role: Role, config: EnvConfig) -> np.ndarray:
    """Return :func:`chances` in some states alone, given by what the agents see there ``(n, n_agents, n_seen)``."""
    n_actions = config.team(role).n_actions
    if callable(_attribute(policy, "chances_batch")) and _attribute(policy, "drawn", True):
        return _checked(_batch_chances(policy, seen, n_actions), seen, role)
    if callable(_attribute(policy, "chances")):
        return _checked(np.array([_state_chances(policy, state, role, n_actions) for state in seen]), seen, role)
    return _certain(_actions(policy, seen, role, config), n_actions)


def _attribute(policy: Any, name: str, default: Any = None) -> Any:
    """Return an attribute of a policy; :class:`PolicyError` from whatever a property raises."""
    try:
        return getattr(policy, name, default)
    except (Exception, SystemExit) as error:
        raise PolicyError(f"the policy's {name} cannot be read: {_named_error(error)}") from error


def _call(policy: Any, method: str, *arguments: Any) -> Any:
    """Call a method of the policy; :class:`PolicyError` from whatever it raises."""
    try:
        return _attribute(policy, method)(*arguments)
    except PolicyError:
        raise
    except (Exception, SystemExit) as error:
        raise PolicyError(f"the policy's {method}() raised {_named_error(error)}") from error


def _named_error(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}"


def _actions(policy: Any, states: np.ndarray, role: Role, config: EnvConfig) -> np.ndarray:
    """Return the policy's actions in some states, int ``(n_states, n_agents)``: asked and checked as in a match."""
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
    except Exception as error:  # of a mapping of its own
        raise PolicyError(f"the policy's actions cannot be read: {_named_error(error)}") from error


def _batch_chances(policy: Any, states: np.ndarray, n_actions: int) -> np.ndarray:
    shape = (*states.shape[:2], n_actions)
    answer = _call(policy, "chances_batch", states.copy())
    return _numbers(answer, shape, f"the policy must answer with an array of shape {shape}")


def _named(state: np.ndarray, role: Role) -> dict[str, np.ndarray]:
    return {f"{PREFIXES[role]}{i}": view for i, view in enumerate(state.copy())}


def _state_chances(policy: Any, state: np.ndarray, role: Role, n_actions: int) -> np.ndarray:
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


def _numbers(answer: Any, shape: tuple[int, ...], expected: str) -> np.ndarray:
    """Return an answer as float64 of a shape; :class:`PolicyError` if it is not one, or cannot be read."""
    reason = ""
    try:
        found = np.asarray(answer, float)
    except (Exception, SystemExit) as error:  # as of a tensor that requires a gradient
        found, reason = np.empty(0), f": {_named_error(error)}"
    if found.shape != shape:
        raise PolicyError(f"{expected}, got {brief(answer)}{reason}")
    return found


def _checked(found: np.ndarray, seen: np.ndarray, role: Role) -> np.ndarray:
    """Return chances ``(n_states, n_agents, n_actions)``; :class:`PolicyError` names the first that are none."""
    totals = found.sum(axis=2)
    wrong = (found < 0).any(axis=2) | ~np.isclose(totals, 1, atol=1e-6)
    if wrong.any():
        state, agent = np.argwhere(wrong)[0]
        raise PolicyError(
            f"chances must be at least 0 and add up to 1, got {brief(found[state, agent].tolist())}, which add up to "
            f"{totals[state, agent]:.6g}, for {PREFIXES[role]}{agent} where it sees {seen[state, agent].tolist()}"
        )
    return found


def _certain(actions: np.ndarray, n_actions: int) -> np.ndarray:
    return np.asarray(np.eye(n_actions)[actions])


@ask_in.register
def _(policy: Team, seen: np.ndarray, role: Role, config: EnvConfig) -> np.ndarray:
    policy.check_fits(role, config)
    found = np.zeros((*seen.shape[:2], config.team(role).n_actions))
    if policy.controller.n_together > 1:
        seen = np.repeat(seen.reshape(len(seen), 1, -1), seen.shape[1], axis=1)
    _team_chances(policy.networks(), np.ascontiguousarray(seen), found)
    return found


@entry_point
def _team_chances(networks: Networks, seen: Any, out: Any) -> None:
    for state in range(out.shape[0]):
        for agent in range(out.shape[1]):
            agent_votes(networks, agent, seen[state, agent])
            if not networks.controller.draws:
                out[state, agent, most_votes(networks.controller, networks.votes)] = 1.0
                continue
            total, before = float(accumulate(networks.controller, networks.votes)), 0.0
            for action in range(out.shape[2]):
                out[state, agent, action] = (networks.votes[action] - before) / total
                before = networks.votes[action]


@ask_in.register
def _(policy: ScriptedTeams, seen: np.ndarray, role: Role, config: EnvConfig) -> np.ndarray:
    return ask_in(ScriptedTeam.of(policy.script, role, config), seen, role, config)


@ask_in.register
def _(policy: ScriptedTeam, seen: np.ndarray, role: Role, config: EnvConfig) -> np.ndarray:
    script = policy.compiled(role, config, 0)
    shape = (*seen.shape[:2], script.n_actions)
    if policy.script == "random":
        return np.full(shape, 1 / script.n_actions)
    actions, memory = np.zeros(shape[:2], np.int64), np.zeros(MEMORY, np.int32)
    if not _script_actions(script, seen, actions, memory):
        raise PolicyError(f"{policy.script} remembers, so that what it does does not follow from the position")
    return _certain(actions, script.n_actions)


@entry_point
def _script_actions(script: Script, seen: Any, out: Any, memory: Any) -> bool:
    """Whether the script remembered nothing."""
    for state in range(out.shape[0]):
        for agent in range(out.shape[1]):
            out[state, agent] = follow(script, agent, seen[state, agent], memory, 0)
            for row in range(len(memory)):
                if memory[row] != 0:
                    return False
    return True
