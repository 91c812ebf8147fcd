"""Sights, which define what agents observe: the offsets of the paper with their options, or a sight of your own."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from predprey_env.jit.generic import Generic
from predprey_env.jit.linking import inlined
from predprey_env.jit.trial import Rows, try_rule
from predprey_env.jit.values import FloatRows, IntegerRows
from predprey_env.plugins import call_method, find_class
from predprey_env.settings import brief

SIGHTS = {"offsets": "predprey_env.sight:Sight"}
"""Name -> class of each observation that ships, as ``module:Class``."""


class AnySight(Protocol):
    """A definition of what agents observe: a named tuple with these methods and a rule registered with :data:`observe`.

    All fields of a sight of your own must have defaults. An attribute ``moves`` states whether the rule reads the last
    moves. A sight without this attribute is assumed to read them, and the exact game refuses it.
    """

    def n_seen(self, n_agents: int, n_opponents: int) -> int:
        """Return the length of an observation of an agent in a team of ``n_agents``; at least 2."""
        ...

    def groups(self, n_agents: int, n_opponents: int) -> Sequence[Sequence[int]]:
        """Return the entries of the observation that belong together, in groups of equal length of at least 2.

        A split controller has a network for each group. A group may be the entries of one other agent, for example.
        """
        ...

    def bounds(self, n_agents: int, n_opponents: int, size: int) -> tuple[ArrayLike, ArrayLike]:
        """Return the lowest and the highest values of the entries on a torus of ``size``: a number for all, or one for
        each.
        """
        ...


class Sight(NamedTuple):
    """Offsets to other agents, with options; by default the paper's observation.

    The fields are those of :class:`~predprey_env.EnvConfig` that begin with ``see_``.
    """

    teammates: bool = False
    moves: bool = False
    identity: bool = False
    nearest_first: bool = False
    scaled: bool = False

    def n_others(self, n_agents: int, n_opponents: int) -> int:
        """Return how many other agents an agent of a team of ``n_agents`` sees."""
        return n_opponents + (n_agents - 1 if self.teammates else 0)

    def n_seen(self, n_agents: int, n_opponents: int) -> int:
        """Return the length of an observation of an agent of a team of ``n_agents``."""
        per_agent = 4 if self.moves else 2
        return per_agent * self.n_others(n_agents, n_opponents) + (n_agents if self.identity else 0)

    def groups(self, n_agents: int, n_opponents: int) -> list[list[int]]:
        """Return the entries of each other agent that is seen: its offset, and perhaps its last move."""
        n_others = self.n_others(n_agents, n_opponents)
        first = (0, 2 * n_others) if self.moves else (0,)
        return [[at + 2 * other + axis for at in first for axis in (0, 1)] for other in range(n_others)]

    def bounds(self, n_agents: int, n_opponents: int, size: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the lowest and the highest values: of offsets, then of last moves and of the identity."""
        n_offsets = 2 * self.n_others(n_agents, n_opponents)
        n_moves = n_offsets if self.moves else 0
        lengths = n_offsets, n_moves, self.n_seen(n_agents, n_opponents) - n_offsets - n_moves
        half = size // 2
        lowest, highest = np.array([-half, size - half - 1], np.float32)
        if self.scaled:
            scale = np.float32(2) / np.float32(size)
            lowest, highest = lowest * scale, highest * scale
        return np.repeat([lowest, -1, 0], lengths), np.repeat([highest, 1, 1], lengths)


PLAIN_SIGHT = Sight()
"""The paper's observation: offsets to the opponents, in cells."""


class _Observe(Generic):
    """The class of :data:`observe`."""

    def __call__(
        self, sight: Any, world: Any, moved: IntegerRows, agent: int, rules: Any, out: FloatRows, row: int
    ) -> int:
        return int(self.known(sight)(sight, world, moved, agent, rules, out, row))


observe = _Observe("observe", "sight")
"""Function that writes an agent's observation and returns the row after it.

It calls the rule of the sight's class, in Python as in compiled code. A rule is registered with
``@observe.register(Class)`` above ``@rule``, and not inherited.

Args:
    sight (AnySight): What agents observe.
    world (World): Columns ``world.x`` and rows ``world.y`` of all agents, predators first, and which prey are free,
        ``world.alive``: rows of int32.
    moved (rows of int32): Last action of every agent, 4 before the first (:data:`predprey_env.config.MOVES`);
        meaningless for a caught prey.
    agent (int): Index of the agent among all agents.
    rules (Rules): The settings of the world: ``rules.size``, ``rules.n_predators``, ``rules.n_prey`` and others.
    out (rows of float32): Where to write.
    row (int): Index of the first row to write.
"""


@inlined(observe)
def _observe(sight, world, moved, agent, rules, out, row):  # type: ignore[no-untyped-def]
    implementation = observe.registry.get(getattr(sight, "instance_class", None))
    if implementation is None:
        return None
    return lambda sight, world, moved, agent, rules, out, row: implementation(
        sight, world, moved, agent, rules, out, row
    )


def options_of(sight: object) -> dict[str, Any]:
    """Return the fields of :class:`~predprey_env.EnvConfig`, by name, that give a world this sight."""
    if type(sight) is Sight:
        return {f"see_{name}": value for name, value in sight._asdict().items()}
    return {"observation": sight_name(sight), **{f"see_{name}": False for name in Sight._fields}}


def sight_name(sight: object) -> str:
    """Return the name of a user's sight, ``module:Class``."""
    return f"{type(sight).__module__}:{type(sight).__qualname__}"


def sight_class(name: str) -> type:
    """Return the class of a sight by its name in :data:`SIGHTS`, or as ``module:Class``.

    Raises :class:`ValueError`, in one line, if there is no such class, or if it does not follow the protocol
    :class:`AnySight`.
    """
    found = find_class("observation", name, SIGHTS)
    observe.check(found, f"observation {name}", calls=("n_seen", "groups", "bounds"))
    unset = [field for field in found._fields if field not in found._field_defaults]
    if unset:
        raise ValueError(f"observation {name} must have a default for each field, got none for {', '.join(unset)}")
    return found


def check_sight(name: str, n_agents: int, n_opponents: int, size: int) -> None:
    """Raise :class:`ValueError`, in one line, unless a sight's methods return valid values for teams of these sizes."""
    sight, what = sight_class(name)(), f"observation {name}"
    n_seen = call_method(what, sight, "n_seen", n_agents, n_opponents)
    if isinstance(n_seen, bool) or not isinstance(n_seen, (int, np.integer)) or n_seen < 2:
        raise ValueError(f"n_seen() of {what} must return an integer of at least 2, got {brief(n_seen)}")
    groups = call_method(what, sight, "groups", n_agents, n_opponents)
    if not _are_groups(groups, int(n_seen)):
        expected = f"groups of equal length, at least 2, of entries in 0..{n_seen - 1}"
        raise ValueError(f"groups() of {what} must return {expected}, got {brief(groups)}")
    bounds = call_method(what, sight, "bounds", n_agents, n_opponents, size)
    if not _are_bounds(bounds, int(n_seen)):
        raise ValueError(f"bounds() of {what} must return the lowest and the highest values, got {brief(bounds)}")


def _are_groups(groups: Any, n_seen: int) -> bool:
    try:
        lengths = {len(group) for group in groups}
        return len(lengths) == 1 and min(lengths) >= 2 and {*chain(*groups)} <= set(range(n_seen))
    except TypeError:  # no lists of lists
        return False


def _are_bounds(bounds: Any, n_seen: int) -> bool:
    try:
        lowest, highest = (np.broadcast_to(np.asarray(each, np.float32), n_seen) for each in bounds)
    except (TypeError, ValueError):  # not two, or not of this length
        return False
    return bool((lowest <= highest).all())


class _World(NamedTuple):
    """A world as rules read it, see :class:`~predprey_env.rules.dynamics.World`."""

    x: Rows
    y: Rows
    alive: Rows


def check_rule(name: str, rules: Any) -> None:
    """Raise :class:`ValueError`, in one line, unless a sight's rule writes observations as the sight declares them.

    The rule is run for each agent of a world in which all agents are apart, and of one in which all are in one cell and
    all prey are caught.
    """
    for agent in range(rules.n_predators + rules.n_prey):
        for apart in (1, 0):
            _try_for(name, rules, agent, apart)


def _try_for(name: str, rules: Any, agent: int, apart: int) -> None:
    """Run the rule of a sight for one agent: with all agents ``apart`` (1), or in one cell with all prey caught (0)."""
    x, y = (Rows(lambda row, k=k: np.int32(apart * k * row % rules.size)) for k in (1, 2))  # type: ignore[misc]
    alive, moved = Rows(lambda _: np.int32(apart)), Rows(lambda row: np.int32(row % 4))
    out = Rows(lambda _: np.float32(0))
    sight, called = rules.sight, f"the rule of observation {name}"
    rule = observe.registry[type(sight)]
    done, end = try_rule(rule, sight, _World(x, y, alive), moved, agent, rules, out, 0)
    n_agents = rules.n_predators + rules.n_prey
    for read, rows in {"world.x": x, "world.y": y, "moved": moved}.items():
        rows.check(called, read, n_agents)
    alive.check(called, "world.alive", rules.n_prey)
    if done:
        hunts = agent < rules.n_predators
        sizes = (rules.n_predators, rules.n_prey) if hunts else (rules.n_prey, rules.n_predators)
        _check_written(called, rules, sizes, out, end)


def _check_written(called: str, rules: Any, sizes: tuple[int, int], out: Rows, end: Any) -> None:
    """Raise :class:`ValueError` unless the rows that a rule wrote, from row 0 on, are a valid observation."""
    n_seen = rules.sight.n_seen(*sizes)
    if sorted(out) != [*range(n_seen)]:
        expected = f"{called} must write {n_seen} rows in a team of {sizes[0]} against {sizes[1]}, as n_seen() says"
        raise ValueError(f"{expected}, got {len(out)}")
    if end != n_seen:
        raise ValueError(f"{called} must return the row after the last that it wrote, got {brief(end)} for {n_seen}")
    written = np.array([out[row] for row in range(n_seen)], np.float64)
    lowest, highest = (np.asarray(each, np.float64) for each in rules.sight.bounds(*sizes, rules.size))
    slack = 1e-3 * (highest - lowest)  # 32-bit floats are rounded
    wrong = written[~((lowest - slack <= written) & (written <= highest + slack))]
    if len(wrong):
        raise ValueError(f"{called} must write numbers within bounds(), got {wrong[0]:g}")
