"""Types that the algorithm, the evaluators and the policies exchange."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple, Protocol, TypeAlias, runtime_checkable

import numpy as np

from esp_trainer.arrays import BoolMask, Cells, Counts, EpisodePayoffs, EpisodeStarts, Fitness, Genomes, Indices, Steps
from esp_trainer.networks.controller import Controller
from predprey_env.arrays import Actions
from predprey_env.config import TEAMS, EnvConfig, TeamName
from predprey_env.policies import SCRIPTS, Policy, ScriptedTeam
from predprey_env.settings import counted
from predprey_env.sight import PLAIN_SIGHT, AnySight


class PolicyError(ValueError):
    """A policy cannot play, or failed while playing. The message is one line."""

    def __init__(self, message: str) -> None:
        super().__init__(" ".join(message.split()))


Role: TypeAlias = TeamName
ROLES = TEAMS


class TeamBatch(Protocol):
    """The teams of one side in a batch of trials."""

    @property
    def indices(self) -> Indices | None:
        """Indices of the neurons of each trial's team; None if one player plays all trials."""
        ...

    @property
    def identity(self) -> bytes:
        """Bytes that differ between teams that play differently."""
        ...

    def part(self, trials: slice) -> TeamBatch:
        """Return the teams of some trials."""
        ...

    def with_indices(self, indices: Indices | None) -> TeamBatch:
        """Return teams of the same neurons with other indices; one player stays as it is."""
        ...


def n_teams(teams: TeamBatch) -> int:
    """Return the number of teams in a batch: one for each trial, or a single player."""
    return 1 if teams.indices is None else len(teams.indices)


def take(teams: TeamBatch, trials: np.ndarray) -> TeamBatch:
    """Return the teams of some trials, in the order of ``trials``, int ``(n,)``."""
    return teams.with_indices(None if teams.indices is None else teams.indices[trials])


@dataclass(frozen=True)
class EvolvedTeams:
    """Teams of networks: candidate neurons, and the indices of those that form the team of each trial."""

    controller: Controller
    genomes: Genomes
    indices: Indices

    def __repr__(self) -> str:
        """Return one line, without the arrays."""
        return f"<EvolvedTeams: {counted(len(self.indices), 'trial')}>"

    @property
    def identity(self) -> bytes:
        """Bytes of the controller and the genes, which differ between champions."""
        return repr(self.controller).encode() + np.ascontiguousarray(self.genomes).tobytes()

    def part(self, trials: slice) -> EvolvedTeams:
        """Return the teams of some trials, made of the same candidates."""
        return EvolvedTeams(self.controller, self.genomes, self.indices[trials])

    def with_indices(self, indices: Indices | None) -> EvolvedTeams:
        """Return teams of the same candidates with other indices."""
        return self if indices is None else EvolvedTeams(self.controller, self.genomes, indices)

    def repeated(self, n: int) -> EvolvedTeams:
        """Return the teams with the team of each trial ``n`` times in a row."""
        return self if n == 1 else EvolvedTeams(self.controller, self.genomes, np.repeat(self.indices, n, axis=0))


@dataclass(frozen=True)
class ScriptedTeams:
    """One scripted policy that plays a side in all trials. It is a :class:`Contestant` too."""

    script: str

    indices: ClassVar[None] = None
    sight: ClassVar[AnySight] = PLAIN_SIGHT

    @property
    def identity(self) -> bytes:
        """The name of the script."""
        return self.script.encode()

    def part(self, trials: slice) -> ScriptedTeams:  # noqa: ARG002 - the script is the same in all trials
        """Return the script as the team of some trials."""
        return self

    def with_indices(self, indices: Indices | None) -> ScriptedTeams:  # noqa: ARG002 - a script has no neurons
        """Return the script."""
        return self

    @property
    def roles(self) -> tuple[Role, ...]:
        """Roles that the script can play."""
        return tuple(role for role in ROLES if self.script in SCRIPTS[role])

    def world(self) -> None:
        """Return None: a script plays in any world."""

    def check_fits(self, role: Role, env: EnvConfig) -> None:
        """Raise :class:`ValueError` unless the script can play a role in a world."""
        self.policy(role, env).compiled(role, env, 0)

    def policy(self, role: Role, env: EnvConfig) -> ScriptedTeam:
        """Return the script as the policy of a role in a world."""
        return ScriptedTeam.of(self.script, role, env)

    def as_teams(self, n_trials: int) -> ScriptedTeams:  # noqa: ARG002 - the script is the same in all trials
        """Return the script as the team of each trial of a batch."""
        return self


def no_teams(controller: Controller | None, n_agents: int) -> TeamBatch:
    """Return teams for zero trials: networks of a controller, or the random script without one."""
    if controller is None:
        return ScriptedTeams("random")
    n_genomes, (n_networks, n_hidden, n_genes) = controller.n_genomes(n_agents), controller.shape
    genomes = np.zeros((n_genomes, n_networks, n_hidden, 1, n_genes), np.float32)
    return EvolvedTeams(controller, genomes, np.zeros((0, n_genomes, n_networks, n_hidden), np.int64))


class Fixed(Protocol):
    """A player that can be given a side of a run without evolving."""

    def as_teams(self, n_trials: int) -> TeamBatch:
        """Return the player as the team of each trial; raise :class:`ValueError` if no evaluator can play it."""
        ...


@runtime_checkable
class Contestant(Fixed, Protocol):
    """A player that fits some worlds: a script, an evolved team, or optimal play."""

    @property
    def roles(self) -> tuple[Role, ...]:
        """Roles that the player can play."""
        ...

    def world(self) -> EnvConfig | None:
        """Return the world that the player is for; None if it names none."""
        ...

    def check_fits(self, role: Role, env: EnvConfig) -> None:
        """Raise :class:`ValueError`, in one line, unless the player can play a role in a world."""
        ...

    def policy(self, role: Role, env: EnvConfig) -> Policy:
        """Return the policy with which the player plays a role in a world."""
        ...


@dataclass(frozen=True)
class TrialBatch:
    """Trials to play: in trial ``t``, team ``t`` of the predators plays team ``t`` of the prey from each of
    ``starts[t]``.
    """

    predators: TeamBatch
    prey: TeamBatch
    starts: EpisodeStarts = field(repr=False)
    """Start of each episode: for the predator-prey world int32 ``(n_trials, n_episodes, n_agents, 2)`` cells."""

    def part(self, trials: slice) -> TrialBatch:
        """Return the batch of some of the trials."""
        return TrialBatch(self.predators.part(trials), self.prey.part(trials), self.starts[trials])


@dataclass(frozen=True)
class TrialResult:
    """Results of a batch. Agents are in order, predators first."""

    fitness: Fitness
    """Fitness of each agent, ``(n_trials, n_episodes, n_agents)``."""
    captured: BoolMask
    """True for each prey that was caught, bool ``(n_trials, n_episodes, n_prey)``."""
    steps: Steps
    """Length of each episode in time steps, int ``(n_trials, n_episodes)``."""
    returned: EpisodePayoffs | None = None
    """Payoff of each episode of another game than the predator-prey world, float64 ``(n_trials, n_episodes)``, see
    :func:`zero_sum_part`; None in the predator-prey world."""

    @property
    def payoff(self) -> EpisodePayoffs:
        """Payoff of each episode to the predators, float64 ``(n_trials, n_episodes)``.

        In the predator-prey world it is the fraction of prey caught; in any other game see :func:`zero_sum_part`.
        """
        return self.captured.mean(axis=-1) if self.returned is None else self.returned

    @property
    def mean_payoff(self) -> float:
        """Mean payoff over all episodes."""
        return float(self.captured.mean() if self.returned is None else self.returned.mean())

    def __repr__(self) -> str:
        """Return one line, without the arrays."""
        n_trials, n_episodes = self.steps.shape
        return f"<TrialResult: {counted(n_trials, 'trial')} of {counted(n_episodes, 'episode')}>"

    def fitness_of(self, role: Role) -> Fitness:
        """Return the fitness of one side, ``(n_trials, n_episodes, n_agents of the side)``."""
        n_prey = self.captured.shape[-1]
        return self.fitness[..., :-n_prey] if role == "predators" else self.fitness[..., -n_prey:]


def zero_sum_part(fitness: Fitness, n_predators: int) -> EpisodePayoffs:
    """Return the payoff of a game to the first team: half the difference of both teams' mean returns per agent.

    If the two mean returns add up to 0, the payoff is that of the first team. Any other game is the sum of such a
    zero-sum game, of which this is the payoff, and of a game in which both teams are paid alike, which no contest
    between them can show.

    Args:
        fitness: Return of each agent, predators first, ``(..., n_agents)``.
        n_predators: Number of agents of the first team.
    """
    return (fitness[..., :n_predators].mean(axis=-1) - fitness[..., n_predators:].mean(axis=-1)) / 2


class Trace(NamedTuple):
    """The course of the episodes of a batch. Agents are in order, predators first."""

    cells: Cells
    """Cell of each agent at the start and after each step, int32 ``(n_trials, n_episodes, max_cycles + 1, n_agents,
    2)``; -1 after the end of an episode."""
    actions: Actions
    """Action of each agent in each step, int8 ``(n_trials, n_episodes, max_cycles, n_agents)``; -1 after the end of an
    episode. The actions of caught prey have no effect."""
    caught_at: Steps
    """Step in which each prey was caught, counted from 1, or 0 if it was not: int32 ``(n_trials, n_episodes,
    n_prey)``."""


class Starts(Protocol):
    """A source of episode starts."""

    def draw(self, generator: np.random.Generator, n_trials: int, n_episodes: int) -> EpisodeStarts:
        """Sample starts, ``(n_trials, n_episodes, ...)``."""
        ...

    def held_out(self, generator: np.random.Generator, n_trials: int) -> EpisodeStarts:
        """Sample starts for measurements, ``(n_trials, 1, ...)``."""
        ...

    def even_predators(self, starts: EpisodeStarts) -> Counts:
        """Return the number of predators that start at an even distance from each prey, int
        ``(n_trials, n_episodes, n_prey)``.
        """
        ...


class Evaluator(Protocol):
    """Plays batches of trials. The algorithm does not depend on the evaluator that is used."""

    @property
    def starts(self) -> Starts:
        """Source of the starts of its episodes."""
        ...

    def evaluate(self, batch: TrialBatch) -> TrialResult:
        """Play every episode of every trial."""
        ...
