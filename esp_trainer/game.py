"""Another game than the predator-prey world: any parallel PettingZoo environment of two teams with discrete actions.

In any other game "predators" and "prey" are no more than the names of the first and the second team.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Protocol, TypeAlias

import numpy as np
from pydantic import Field, model_validator

from esp_trainer.arrays import BoolMask
from esp_trainer.types import ROLES, Role
from predprey_env.agents import agent_number
from predprey_env.arrays import Actions, Observation, Seeds
from predprey_env.config import TeamShape
from predprey_env.plugins import find_object
from predprey_env.settings import PartError, Settings, brief, error_line

Environment: TypeAlias = Any
"""A ``pettingzoo.ParallelEnv``. An environment is recognised by its methods, not by its class."""

_METHODS = ("reset", "step", "observation_space", "action_space")


class ManyEpisodes(Protocol):
    """Episodes of a game side by side, in arrays. All agents stay until their episode ends.

    An environment that has a method ``many()``, which returns such an object, is played through it. A step then takes
    one Python call for hundreds of episodes, instead of one for each. Episodes must be as in the environment itself.
    """

    def reset(self, seeds: Seeds) -> Mapping[str, Observation]:
        """Begin an episode for each seed, int64 ``(n,)``. Return what each agent observes, ``(n, n_seen)``."""
        ...

    def step(
        self, actions: Mapping[str, Actions]
    ) -> tuple[Mapping[str, Observation], Mapping[str, np.ndarray], BoolMask]:
        """Take a step in all episodes, by each agent's actions, int64 ``(n,)``.

        Return what each agent observes, ``(n, n_seen)``, its rewards, ``(n,)``, and which episodes are over, bool
        ``(n,)``. What is returned for an episode that was over before does not matter.
        """
        ...


class GameError(PartError):
    """A game cannot be played, or failed while it was played. The message is one line."""

    def __init__(self, message: str) -> None:
        super().__init__(" ".join(message.split()))


@contextmanager
def in_one_line(environment: str, doing: str) -> Iterator[None]:
    """Convert an exception of an environment to a :class:`GameError`, in one line."""
    try:
        yield
    except GameError:
        raise
    except Exception as error:
        raise GameError(f"{environment} failed {doing}: {error_line(error)}") from error


class GameConfig(Settings):
    """Another game than the predator-prey world; by default none."""

    environment: str = ""
    """Parallel PettingZoo environment of two teams: a module with a function `parallel_env`, such as
    `mpe2.simple_tag_v3`, or `module:callable`. Empty for the predator-prey world of `env`. In another game predators
    and prey are no more than the names of the first and the second team."""

    options: dict[str, bool | int | float | str] = Field(default={})
    """Keyword arguments of the environment."""

    predators: str = ""
    """Beginning of the names of the first team's agents, such as `adversary_`."""

    prey: str = ""
    """Beginning of the names of the second team's agents, such as `agent_`."""

    @model_validator(mode="after")
    def _names_both_teams(self) -> GameConfig:
        given = {name: getattr(self, name) for name in ("options", "predators", "prey")}
        if not self.environment:
            extra = next((name for name, value in given.items() if value), None)
            if extra:
                raise ValueError(f"{extra} has no meaning without game.environment, got {given[extra]!r}")
        for role in ROLES:
            if self.environment and not given[role]:
                raise ValueError(f"{role} must be the beginning of the names of that team's agents, got ''")
        return self


@dataclass(frozen=True)
class Game:
    """The teams of a game, as its environment declares them."""

    name: str
    agents: Mapping[Role, tuple[str, ...]]
    """Names of each team's agents, in the order of their numbers."""
    shapes: Mapping[Role, TeamShape]
    """Sizes of each team."""
    has_many: bool = False
    """True if the environment can play :class:`ManyEpisodes`."""

    @property
    def words(self) -> str:
        """The game in words, for example "3 adversary_ against 1 agent_ in mpe2.simple_tag_v3"."""
        teams = " against ".join(f"{len(names)} {names[0].rpartition('_')[0]}" for names in self.agents.values())
        return f"{teams} in {self.name}"


def make_environment(config: GameConfig) -> Environment:
    """Return a new environment.

    Raises :class:`GameError` if it cannot be imported or made, or if it is no ``pettingzoo.ParallelEnv``.
    """
    name = config.environment
    try:
        make: Callable[..., Any] = find_object("game.environment", name if ":" in name else f"{name}:parallel_env")
    except ValueError as error:
        raise GameError(str(error)) from None
    if not callable(make):
        raise GameError(f"game.environment {name} must be a function or a class, got {type(make).__name__}")
    try:
        env = make(**config.options)
    except Exception as error:
        raise GameError(f"game.environment {name} cannot be made: {error_line(error)}") from None
    missing = [f"{method}()" for method in _METHODS if not callable(getattr(env, method, None))]
    missing += ["possible_agents"] if not hasattr(env, "possible_agents") else []
    if missing:
        lacks = " and no ".join(missing)
        raise GameError(f"game.environment {name} must be a pettingzoo.ParallelEnv, got one that has no {lacks}")
    return env


def game_of(config: GameConfig) -> Game:
    """Return the teams of a game. Raises :class:`GameError` if a team cannot be played."""
    return _known(config.model_dump_json())


@lru_cache(maxsize=8)
def _known(config: str) -> Game:
    read = GameConfig.model_validate_json(config)
    env = make_environment(read)
    try:
        with in_one_line(read.environment, "when it was asked for its agents"):
            return describe_game(read, env)
    finally:
        if callable(getattr(env, "close", None)):
            env.close()


def describe_game(config: GameConfig, env: Environment) -> Game:
    """Return the teams that an environment declares. Raises :class:`GameError` if a team cannot be played."""
    name, everybody = config.environment, list(env.possible_agents)
    prefixes: dict[Role, str] = {"predators": config.predators, "prey": config.prey}
    teams: dict[Role, list[str]] = {role: [a for a in everybody if a.startswith(prefixes[role])] for role in ROLES}
    for role in ROLES:
        if not teams[role]:
            raise GameError(
                f"game.{role} must begin the name of an agent of {brief(everybody)}, got {prefixes[role]!r}"
            )
    for agent in everybody:
        times = sum(agent in team for team in teams.values())
        if times != 1:
            raise GameError(
                f"every agent of {name} must be in one team, got {agent} in {'both' if times else 'none'} of "
                f"{prefixes['predators']!r} and {prefixes['prey']!r}"
            )
    shapes = {}
    for role, agents in teams.items():
        _check_numbers(role, agents)
        sizes = {agent: _sizes(name, env, agent) for agent in agents}
        first = agents[0]
        for agent, found in sizes.items():
            if found != sizes[first]:
                raise GameError(
                    f"the {role} of {name} must see and act alike, got {first} with {_in_words(sizes[first])} and "
                    f"{agent} with {_in_words(found)}"
                )
        n_seen, n_actions = sizes[first]
        shapes[role] = TeamShape(len(agents), len(everybody) - len(agents), n_actions, n_seen)
    return Game(name, {role: tuple(agents) for role, agents in teams.items()}, shapes, can_play_many(env))


def can_play_many(env: Environment) -> bool:
    """Return whether an environment has a method ``many()``, see :class:`ManyEpisodes`."""
    return callable(getattr(env, "many", None))


def _check_numbers(role: Role, agents: list[str]) -> None:
    """Raise :class:`GameError` unless names end in numbers from 0 on, by which saved teams find their networks."""
    try:
        if [agent_number(agent) for agent in agents] == list(range(len(agents))):
            return
    except ValueError:
        pass
    raise GameError(f"the names of the {role} must end in _0, _1 and so on, in this order, got {brief(agents)}")


def _sizes(name: str, env: Environment, agent: str) -> tuple[int, int]:
    """Return the length of an agent's observation, and its number of actions."""
    seen, acts = env.observation_space(agent), env.action_space(agent)
    if len(getattr(seen, "shape", None) or ()) != 1:
        raise GameError(f"observations of {name} must be vectors, Box(n,), got {brief(seen)} of {agent}")
    if not hasattr(acts, "n") or getattr(acts, "start", 0) != 0 or getattr(acts, "shape", None) not in ((), None):
        raise GameError(f"actions of {name} must be Discrete(n), got {brief(acts)} of {agent}")
    if seen.shape[0] < 2 or acts.n < 2:
        raise GameError(
            f"a network needs 2 observed numbers and 2 actions, got {agent} with {_in_words((seen.shape[0], acts.n))}"
        )
    return int(seen.shape[0]), int(acts.n)


def _in_words(sizes: tuple[int, int]) -> str:
    return "{} observed numbers and {} actions".format(*sizes)
