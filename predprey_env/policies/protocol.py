"""Interface between the environment and a policy that plays a team: in Python, and in compiled code."""

from __future__ import annotations

from collections.abc import Mapping
from operator import index
from typing import Any, Protocol, TypeAlias, runtime_checkable

import numpy as np

from predprey_env.arrays import Observations
from predprey_env.jit.compilation import entry_point, rule
from predprey_env.jit.generic import Generic
from predprey_env.jit.linking import inlined
from predprey_env.jit.values import FloatRows, IntegerRows, Value
from predprey_env.policies.chance import scramble
from predprey_env.sight import AnySight, Sight

MEMORY = 4
"""Least number of int32 rows of memory that a compiled player has for each of its agents; see :data:`memory_rows`."""


Player: TypeAlias = Any
"""A team in compiled code: a named tuple for whose class :data:`choose` has a rule. Its arrays are laid out for one
world or for a block of worlds."""

_PREY = 1 << 20  # added to the index of a prey, so that no prey shares its random numbers with a predator


@rule
def first_memory(seed: int, prey: bool, agent: int, row: int) -> int:
    """Return a row of an agent's memory at the start of an episode.

    The first row is the state from which random choices start; the others are 0.
    """
    return scramble(seed, agent + (_PREY if prey else 0)) if row == 0 else 0


@entry_point
def _begin(memory: IntegerRows, seed: int, prey: bool, agent: int) -> None:
    for row in range(len(memory)):
        memory[row] = first_memory(seed, prey, agent, row)


class Memories:
    """Memory of a team whose agents choose one at a time: int32 ``(n_rows,)`` for each agent."""

    def __init__(self, prey: bool, n_rows: int = MEMORY) -> None:
        self._prey, self._n_rows = prey, n_rows
        self._seed: int | None = None  # sampled when first needed
        self._of: dict[int, np.ndarray] = {}

    def reset(self, seed: int | None) -> None:
        """Start an episode; without a seed, random choices differ each time."""
        self._seed = None if seed is None else index(seed) % 2**31
        self._of.clear()

    def of(self, agent: int) -> np.ndarray:
        """Return the memory of the agent with this number in its team, for the caller to change."""
        if agent not in self._of:
            if self._seed is None:
                self._seed = int(np.random.default_rng().integers(2**31))
            self._of[agent] = np.zeros(self._n_rows, np.int32)
            _begin(self._of[agent], self._seed, self._prey, agent)
        return self._of[agent]


@runtime_checkable
class Policy(Protocol):
    """A policy that plays one team: it chooses for one agent at a time, or for all of them together.

    A policy may also have a method ``compiled(team: TeamName, env: EnvConfig, lanes: int) -> player``, with which
    :func:`predprey_env.vector_env` plays it without leaving compiled code. The player is a named tuple for which
    :data:`choose` has a rule; its arrays are laid out for one world (``lanes = 0``) or for a block of worlds. The
    method raises :class:`ValueError` if the policy cannot play that team in that world.

    Or it may have a method ``act_batch(observations)``, from float32 ``(n_worlds, n_agents, n_seen)`` to int
    ``(n_worlds, n_agents)``, which a vector environment calls once for all worlds. Such a policy must have no memory:
    calls include worlds that are over, and a step has more than one call when other worlds have just begun.

    A policy with an attribute ``sight``, a :class:`predprey_env.Sight`, has that observation in every world. Other
    policies have the observation of the world's options.
    """

    def reset(self, seed: int | None = None) -> None:
        """Start an episode and forget the last one. All random choices follow from the seed, in [0, 2**31)."""
        ...

    def act(self, observations: Observations) -> Mapping[str, int]:
        """Return an action for each agent of the team that has an observation."""
        ...


class _Choose(Generic):
    """Generic function that returns the action of one agent of a team: ``choose(player, agent, seen, memory, at)``.

    It calls the rule of the player's class, in Python as in compiled code. Rules are not inherited.

    Args:
        player: Player of the team, a named tuple.
        agent: Index of the agent in its team.
        seen: Rows of float32: the agent's observation, or, if the player :data:`sees_team`, the observations of all
            agents of the team, one after the other.
        memory: Memory of the player: rows of int32, :func:`first_memory` when an episode starts.
        at: Index of the agent's first row of memory; the agent has :data:`memory_rows` of them.
    """

    def __call__(self, player: Player, agent: int, seen: FloatRows, memory: IntegerRows, at: int) -> Value:
        return self.known(player)(player, agent, seen, memory, at)


class _SeesTeam(Generic):
    """Generic function that returns whether a player chooses from the observations of all agents of its team.

    By default a player chooses from the agent's own observation. ``sees_team.register(Player, rule)``, with
    ``rule(player) -> bool``, changes this for a class.
    """

    def __call__(self, player: Player) -> bool:
        return bool(self.in_python(player)(player))


class _SightOf(Generic):
    """Generic function that returns what a player's agents observe, a :class:`predprey_env.Sight`.

    By default it is the paper's observation. ``sight_of.register(Player, rule)``, with ``rule(player) -> AnySight``,
    changes this for a class.
    """

    def __call__(self, player: Player) -> AnySight:
        found: AnySight = self.in_python(player)(player)
        return found


class _MemoryRows(Generic):
    """Generic function that returns the number of int32 rows of memory that a player needs for each of its agents.

    By default, and at least, it is :data:`MEMORY`. ``memory_rows.register(Player, function)``, with
    ``function(player) -> int``, changes this for a class; Python calls the function before play.
    """

    compiled = False

    def __call__(self, player: Player) -> int:
        function = self.registry.get(type(player))
        return MEMORY if function is None else max(MEMORY, int(function(player)))


@rule
def _sees_itself(player: Player) -> bool:
    return False


@rule
def _opponents_only(player: Player) -> Sight:
    return Sight(False, False, False, False, False)


choose = _Choose("choose")
"""Action of one agent, by the rule of the player's class: put ``@choose.register(Player)`` above ``@rule``. The rule is
called with ``(player, agent, seen, memory, at)``."""
sees_team = _SeesTeam("sees_team", default=_sees_itself)
"""Whether a player chooses from the observations of its whole team; by default it does not."""
sight_of = _SightOf("sight_of", default=_opponents_only)
"""Observation of a player's agents, a :class:`predprey_env.Sight`; by default the paper's."""
memory_rows = _MemoryRows("memory_rows")
"""Number of int32 rows of memory that a player needs for each agent; by default four."""


@inlined(choose)
def _choose(player, agent, seen, memory, at):  # type: ignore[no-untyped-def]
    implementation = choose.registry.get(getattr(player, "instance_class", None))
    if implementation is None:
        return None
    return lambda player, agent, seen, memory, at: implementation(player, agent, seen, memory, at)


@inlined(sees_team)
def _sees_team(player):  # type: ignore[no-untyped-def]
    implementation = sees_team.registry.get(getattr(player, "instance_class", None), sees_team.default)
    return lambda player: implementation(player)


@inlined(sight_of)
def _sight_of(player):  # type: ignore[no-untyped-def]
    implementation = sight_of.registry.get(getattr(player, "instance_class", None), sight_of.default)
    return lambda player: implementation(player)
