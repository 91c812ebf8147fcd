"""An evolved team: fixed networks that play, and a file that records their origin."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from esp_trainer.arrays import Genomes, TeamGenomes
from esp_trainer.config import SideConfig
from esp_trainer.esp.controller import make_controller, wiring_for
from esp_trainer.esp.network import Networks
from esp_trainer.files import DamagedFileError, read_arrays, write_arrays
from esp_trainer.networks.controller import Controller
from esp_trainer.types import ROLES, EvolvedTeams, Role
from predprey_env.agents import PREFIXES, agent_number, other_team
from predprey_env.arrays import Observations
from predprey_env.config import EnvConfig
from predprey_env.jit.compilation import entry_point
from predprey_env.policies.protocol import Memories, choose, memory_rows
from predprey_env.settings import counted, plain
from predprey_env.sight import AnySight, Sight, sight_class, sight_name

IN_A_WORLD = '{"env": EnvConfig(...).model_dump()}'
"""Provenance that names a team's world, as errors and notes recommend it."""


@entry_point
def _decide(networks: Networks, agent: int, seen: Any, memory: Any) -> int:
    return choose(networks, agent, seen, memory, 0)


@dataclass(frozen=True, eq=False)
class Team:
    """The agents of one side with fixed networks.

    Implements the policy protocol: ``reset(seed)``, ``act(observations) -> actions``. The number at the end of an
    agent's name selects its networks, so ``predator_1`` and ``adversary_1`` are both the second agent of their team. A
    team whose actions are sampled holds the state of its random numbers: give each environment a copy of its own.
    """

    role: Role
    side: SideConfig
    controller: Controller
    genomes: TeamGenomes
    """float32 ``(n_agents, n_networks, n_hidden, n_genes)``; a single genome for all agents of a central controller."""
    provenance: Mapping[str, Any] = field(default_factory=dict)
    """Origin of the team, as JSON values: the config of its run, its generation and its scores. ``"env"`` in it is the
    world that the team plays in, ``EnvConfig(...).model_dump()``; without it the commands assume the paper's world."""
    n_seen: int | None = None
    """Length of the observations that the team evolved on; None for any length that holds what its networks read."""

    _memories: Memories = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_memories", Memories(self.role == "prey", memory_rows(self.networks())))
        object.__setattr__(self, "provenance", self.provenance or {})  # None counts as no provenance
        if self.genomes.ndim != 4 or self.genomes.shape[1:] != self.controller.shape:
            needed = f"genomes of {self.side.network} networks must have shape (agents, *{self.controller.shape})"
            raise ValueError(f"{needed}, got {self.genomes.shape}")
        if not np.isfinite(self.genomes).all():
            raise ValueError("genomes must be finite, got NaN or infinity")

    def __repr__(self) -> str:
        """Return one line, without the hundreds of weights."""
        origin = self.provenance
        source = [f"{name} {origin[name]}" for name in ("preset", "seed", "generation") if name in origin]
        return f"<Team: {', '.join([_agents(self.n_agents, self.role), f'{self.side.controller} networks', *source])}>"

    def world(self) -> EnvConfig | None:
        """Return the world that the team is for; None if its provenance names none.

        Raises :class:`ValueError` if the provenance holds something that is no world.
        """
        if "env" not in self.provenance:
            return None
        try:
            return EnvConfig.from_dict(self.provenance["env"])
        except ValueError as error:
            raise ValueError(f"{error}: save the team with provenance {IN_A_WORLD}") from None

    @property
    def game(self) -> str:
        """Environment of the game that the team evolved in; empty for the predator-prey world."""
        game = self.provenance.get("game", {})
        return str(game.get("environment", "")) if isinstance(game, Mapping) else ""

    @property
    def roles(self) -> tuple[Role, ...]:
        """The role of the team; see :class:`~esp_trainer.types.Contestant`."""
        return (self.role,)

    @property
    def sight(self) -> AnySight:
        """Return what the agents observe, in whatever world they play; see :class:`predprey_env.policies.Policy`."""
        return self.controller.sight

    @property
    def n_opponents(self) -> int:
        """Smallest number of opponents with which the agents observe all entries that the networks read."""
        last = self.controller.wiring.max()
        return next((n for n in range(1, int(last) + 1) if self._last_entry(n) >= last), 1)

    def _last_entry(self, n_opponents: int) -> int:
        """Return the last observation entry that networks like these read in a world with ``n_opponents`` opponents."""
        return int(wiring_for(self.side, n_opponents, self.n_agents, self.sight).max())

    def policy(self, role: Role, env: EnvConfig) -> Team:
        """Return the team itself, which is a policy; raise :class:`ValueError` if it does not fit."""
        self.check_fits(role, env)
        return self

    @property
    def n_agents(self) -> int:
        """Number of agents of the team."""
        return len(self.genomes) * self.controller.n_together

    def reset(self, seed: int | None = None) -> None:
        """Start an episode. The seed determines sampled actions; a team that takes the most votes has no randomness."""
        self._memories.reset(seed)

    def act(self, observations: Observations) -> dict[str, int]:
        """Return an action for each agent of this team that has an observation, float32 ``(n_seen,)``."""
        networks, other = self.networks(), PREFIXES[other_team(self.role)]
        rows = {agent: agent_number(agent) for agent in observations if not agent.startswith(other)}
        for agent, row in rows.items():
            self._check(agent, row, len(observations[agent]))
        views = {row: np.ascontiguousarray(observations[agent], np.float32) for agent, row in rows.items()}
        if self.controller.n_together > 1:
            whole = np.zeros((self.n_agents, self.controller.n_seen), np.float32)  # a caught prey sees zeros
            for row, view in views.items():
                whole[row] = view[: self.controller.n_seen]
            views = dict.fromkeys(views, whole.ravel())
        return {agent: int(_decide(networks, row, views[row], self._memories.of(row))) for agent, row in rows.items()}

    def compiled(self, team: Role, env: EnvConfig, lanes: int) -> Networks:
        """Return the team as a player in compiled code, for one world (``lanes = 0``) or ``lanes`` worlds at a time.

        Raises :class:`ValueError` if the team plays the other side or does not fit the world.
        """
        self.check_fits(team, env)
        networks = self.networks()
        if not lanes:
            return networks
        rows = (np.repeat(array[:, None], lanes, axis=1) for array in networks[1:])
        return Networks(networks.controller, *rows)

    def check_fits(self, role: Role, env: EnvConfig) -> None:
        """Raise :class:`ValueError` unless the team can play a role in a world."""
        if self.game:
            raise ValueError(f"this command is for the predator-prey world, got a team that plays {self.game}")
        if self.role != role:
            raise ValueError(f"expected {role}, got a team of {self.role}")
        n_agents, n_opponents, n_actions, _ = env.team(role)
        if self.n_agents != n_agents:
            raise ValueError(f"this world has {_agents(n_agents, role)}, got a team of {self.n_agents}")
        if self._last_entry(n_opponents) != self.controller.wiring.max():
            evolved = f"{role} evolved against {self.n_opponents}"
            raise ValueError(f"this world has {_agents(n_opponents, other_team(role))}, got {evolved}")
        if self.controller.n_actions != n_actions:
            got = self.controller.n_actions
            raise ValueError(f"{role} have {n_actions} actions in this world, got a team with {got}")

    def networks(self) -> Networks:
        """Return the team as a player in compiled code, for one world."""
        inputs, votes = (
            np.empty(max(self.controller.fan_in) + 1, np.float32),
            np.empty(self.controller.n_votes, np.float32),
        )
        genes = np.array(self.genomes, np.float32).ravel()  # a copy, as code is compiled anew for a read-only array
        return Networks(self.controller, genes, inputs, votes)

    def _check(self, agent: str, row: int, length: int) -> None:
        least = self.controller.n_seen
        if row >= self.n_agents:
            raise ValueError(f"{agent} is not in this team of {self.n_agents} {self.role}")
        if length < least or self.n_seen not in (None, length):
            expected = f"at least {least}" if self.n_seen is None else str(self.n_seen)
            raise ValueError(f"{agent} must observe {expected} numbers for this team, got {length}")

    def as_teams(self, n_trials: int) -> EvolvedTeams:
        """Repeat this team for each trial of a batch."""
        return in_every_trial(self.controller, self.genomes, n_trials)

    def save(self, path: Path | str) -> None:
        """Write the team to a file. Raises :class:`ValueError` if its provenance cannot be written as JSON."""
        try:
            provenance = json.loads(json.dumps(dict(self.provenance), default=_as_json, allow_nan=False))
        except (TypeError, ValueError) as error:
            raise ValueError(f"provenance must hold JSON values, such as config.model_dump(): {error}") from None
        header: dict[str, Any] = {
            "role": self.role,
            "side": self.side.model_dump(),
            "n_agents": self.n_agents,
            "n_actions": self.controller.n_actions,
        }
        header |= {"n_seen": self.n_seen, **_sight_header(self.sight), "provenance": provenance}
        arrays = {"genomes": self.genomes, "wiring": self.controller.wiring}
        write_arrays(Path(path), "team", header, arrays)

    @classmethod
    def load(cls, path: Path | str) -> Team:
        """Read a team from a file. Raises :class:`DamagedFileError`, in one line, for a damaged or any other file."""
        path = Path(path)
        header, arrays = read_arrays(path, "team")
        try:
            side = SideConfig.from_dict(header["side"])
            n_agents, sight = header.get("n_agents", 1), _read_sight(header)
            controller = make_controller(side, arrays["wiring"], header["n_actions"], n_agents, sight)
            if header["role"] not in ROLES:
                raise ValueError(f"role must be one of {', '.join(ROLES)}, got {header['role']!r}")
            origin, n_seen = dict(header["provenance"]), header["n_seen"]
            return cls(header["role"], side, controller, arrays["genomes"], origin, n_seen)
        except KeyError as error:
            raise DamagedFileError(f"{path} is not a usable team: {error.args[0]} is missing") from None
        except (ValueError, TypeError) as error:
            raise DamagedFileError(f"{path} is not a usable team: {error}") from None


def _sight_header(sight: AnySight) -> dict[str, Any]:
    """Return the part of a team's file about its sight: options of the paper's sight, or the name of a user's own."""
    return {"sight": sight._asdict()} if type(sight) is Sight else {"observation": sight_name(sight)}


def _read_sight(header: dict[str, Any]) -> AnySight:
    """Return the sight that a team's file names. Files from before there were several sights name none."""
    if "observation" in header:
        own: AnySight = sight_class(str(header["observation"]))()
        return own
    options = header.get("sight", {})
    if not (isinstance(options, dict) and all(isinstance(value, bool) for value in options.values())):
        raise ValueError(f"sight must hold booleans, got {options}")
    return Sight(**options)


def _as_json(value: Any) -> Any:
    """Return a NumPy scalar as a plain number."""
    number = plain(value)
    if number is value:
        raise TypeError(f"Object of type {type(value).__name__} is not JSON serializable")
    return number


def gather_genomes(teams: EvolvedTeams, trials: np.ndarray) -> TeamGenomes:
    """Return a copy of the genomes of the teams of some trials.

    The result is float32 ``(len(trials), n_agents, n_networks, n_hidden, n_genes)``.
    """
    agent, network, neuron = np.ogrid[tuple(slice(n) for n in teams.indices.shape[1:])]
    return teams.genomes[agent, network, neuron, teams.indices[trials]]


def in_every_trial(controller: Controller, genomes: TeamGenomes, n_trials: int) -> EvolvedTeams:
    """Repeat one team ``(n_agents, n_networks, n_hidden, n_genes)`` for all trials of a batch."""
    return EvolvedTeams(controller, genomes[:, :, :, None], np.zeros((n_trials, *genomes.shape[:3]), np.int64))


def as_candidates(genomes: TeamGenomes) -> Genomes:
    """Return whole teams ``(n_teams, n_agents, n_networks, n_hidden, n_genes)`` as candidates of each neuron."""
    return np.ascontiguousarray(np.moveaxis(genomes, 0, 3))


def _agents(n: int, role: Role) -> str:
    return counted(n, role.removesuffix("s"))
