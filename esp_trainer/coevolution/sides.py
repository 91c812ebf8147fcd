"""The two sides of a run, each evolving or fixed."""

from __future__ import annotations

from dataclasses import dataclass
from inspect import signature
from typing import TypeAlias

import numpy as np

from esp_trainer.algorithm import Algorithm
from esp_trainer.algorithms.registry import ALGORITHMS, algorithm_class, check_restores, failures_told
from esp_trainer.coevolution.hall_of_fame import HallOfFame
from esp_trainer.coevolution.league import NO_LEAGUE, League
from esp_trainer.config import RunConfig, SideConfig
from esp_trainer.esp.controller import make_controller, wiring_for
from esp_trainer.game import game_of
from esp_trainer.networks.controller import Controller
from esp_trainer.seeding import stream
from esp_trainer.types import ROLES, Fixed, Role, ScriptedTeams
from predprey_env.config import TeamShape
from predprey_env.settings import PartError


@dataclass
class EvolvingSide:
    """A side that evolves: its algorithm, its champions so far, and the generations since the best score."""

    algorithm: Algorithm
    hall_of_fame: HallOfFame
    best: float = -np.inf
    """Highest score of a champion since the last burst."""
    stagnant: int = 0
    """Number of generations since the highest score."""


Side: TypeAlias = EvolvingSide | Fixed


def side_config(config: RunConfig, role: Role) -> SideConfig:
    """Return the settings of one side."""
    return config.predators if role == "predators" else config.prey


def side_shape(config: RunConfig, role: Role) -> TeamShape:
    """Return the sizes of one side's team. Raises :class:`~esp_trainer.game.GameError` if there is no such game."""
    return game_of(config.game).shapes[role] if config.game.environment else config.env.team(role)


def side_controller(config: RunConfig, role: Role) -> Controller:
    """Return the controller of one side's agents."""
    settings, shape, sight = side_config(config, role), side_shape(config, role), config.env.sight
    if config.game.environment:  # one network, which reads all that the agent observes
        wiring = np.arange(shape.n_seen).reshape(1, -1)
    else:
        wiring = wiring_for(settings, shape.n_opponents, shape.n_agents, sight)
    return make_controller(settings, wiring, shape.n_actions, shape.n_agents, sight)


def check_parts(config: RunConfig) -> None:
    """Raise :class:`ValueError` unless the networks and the algorithms of a run exist and accept their options.

    No teams are made, so that a sweep can check its runs before the first one begins.
    """
    for role in ROLES:
        if side_config(config, role).policy == "esp":
            side_controller(config, role)
            _algorithm_class(config, role)


def new_sides(config: RunConfig, league: League = NO_LEAGUE) -> dict[Role, Side]:
    """Return both sides before the first generation. The champions of a league are guests of their halls of fame."""
    return {role: _new_side(config, role, league) for role in ROLES}


def new_hall_of_fame(config: RunConfig, role: Role, league: League = NO_LEAGUE) -> HallOfFame:
    """Return the hall of fame of a side that evolves before the first generation, without its algorithm."""
    controller = side_controller(config, role)
    n_genomes = controller.n_genomes(side_shape(config, role).n_agents)
    nobody = np.empty((0, n_genomes, *controller.shape), np.float32)
    return HallOfFame(nobody, config.esp.hof_size, guests=league.genomes.get(role))


def _new_side(config: RunConfig, role: Role, league: League) -> Side:
    policy = side_config(config, role).policy
    if policy != "esp":
        return ScriptedTeams(policy)
    return EvolvingSide(_started(config, role), new_hall_of_fame(config, role, league))


def _started(config: RunConfig, role: Role) -> Algorithm:
    """Return the algorithm of a side before the first generation."""
    kind, options = _algorithm_class(config, role), side_config(config, role).algorithm_options
    controller = side_controller(config, role)
    n_genomes = controller.n_genomes(side_shape(config, role).n_agents)
    name = side_config(config, role).algorithm

    def start(generator: np.random.Generator) -> Algorithm:
        with failures_told(name, "start()"):
            return kind.start(config.esp, controller, n_genomes, generator, **options)

    try:
        algorithm = start(stream(config.seed, f"initial {role}"))
        if name not in ALGORITHMS:  # now, and not when the first checkpoint is written or read
            check_restores(algorithm, start(stream(config.seed, f"restored {role}")))
        return algorithm
    except PartError as error:
        raise PartError(f"{role}: {error}") from error.__cause__
    except ValueError as error:
        raise ValueError(f"{role}: {error}") from None


def _algorithm_class(config: RunConfig, role: Role) -> type[Algorithm]:
    """Return the class of a side's algorithm.

    Raises :class:`ValueError` if there is none of that name, or if it does not accept the side's options.
    """
    name, options = side_config(config, role).algorithm, side_config(config, role).algorithm_options
    try:
        kind = algorithm_class(name)
        signature(kind.start).bind("config", "controller", "n_genomes", "generator", **options)
    except ValueError as error:
        raise ValueError(f"{role}: {error}") from None
    except TypeError as error:
        raise ValueError(f"{role}: algorithm {name} cannot start with these options: {error}") from None
    return kind
