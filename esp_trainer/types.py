"""The vocabulary of the trainer: what the algorithm, the evaluators and the policies exchange."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple, Protocol, TypeAlias

import numpy as np

from predprey_env.config import TEAMS, TeamName


class PolicyError(ValueError):
    """A policy cannot play, or failed while playing. The message is one line."""

    def __init__(self, message: str) -> None:
        super().__init__(" ".join(message.split()))


Role: TypeAlias = TeamName
ROLES = TEAMS

Genomes: TypeAlias = np.ndarray
"""float32 ``(n_agents, n_networks, n_hidden, n_candidates, n_genes)``: for each hidden neuron of each network of each
agent, a subpopulation of candidate neurons. A gene string is the neuron's input weights, its bias if there is one, and
its output weights (section V). A central controller counts as one agent."""

Indices: TypeAlias = np.ndarray
"""int ``(n_trials, n_agents, n_networks, n_hidden)``: which candidate each hidden neuron of each trial's team is. They
are most of what a trial needs, so those of a generation are of the smallest type that holds them."""

Fitness: TypeAlias = np.ndarray
"""float64, higher is better."""


class Controller(NamedTuple):
    """How an agent's networks turn what it sees into an action: plain numbers, as compiled code reads them."""

    n_networks: int
    """Networks that read the observation."""
    n_inputs: int
    """Inputs of each of them, without the bias."""
    n_hidden: int
    blank: tuple[np.float32, ...]
    """As many zeros as there are actions; compiled code takes the number from the type."""
    bias: bool
    logistic_output: bool
    draws: bool
    """Whether the action is drawn by the votes; else it is the one with the most."""
    skip_silent: bool
    """Whether a network whose inputs are all zero (its opponent is caught) has no vote."""
    input_scale: np.float32
    """Factor on the observation, in 1/cells."""
    combines: bool
    """Whether one more network, the combiner, reads the outputs of the others and decides; else they are summed."""
    n_together: int
    """Agents that one set of networks steers: 1, or the whole team of a central controller. It reads their views one
    after the other, and its neurons have output weights for each of them."""
    n_genes: int
    """Length of a gene string in the genome; those of networks that need fewer are filled up with zeros."""
    wiring: np.ndarray
    """int64 ``(n_networks, n_inputs)``: which entries of the observation each network reads."""

    @property
    def fan_in(self) -> tuple[int, ...]:
        """Inputs of each network of the genome, without the bias; the combiner comes last."""
        combiner = (self.n_networks * len(self.blank),) if self.combines else ()
        return (self.n_inputs,) * self.n_networks + combiner

    @property
    def used_genes(self) -> tuple[int, ...]:
        """For each network of the genome, how many genes of a neuron it reads."""
        return tuple(n + int(self.bias) + self.n_together * len(self.blank) for n in self.fan_in)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Shape of one genome: ``(n_networks, n_hidden, n_genes)``, the combiner counted."""
        return len(self.fan_in), self.n_hidden, self.n_genes

    @property
    def n_seen(self) -> int:
        """Length of one agent's observation, of which all is read."""
        return (int(self.wiring.max()) + 1) // self.n_together

    @property
    def n_votes(self) -> int:
        """Rows that compiled code needs for outputs."""
        return len(self.blank) * (self.n_networks if self.combines else 1)


@dataclass(frozen=True)
class EvolvedTeams:
    """The teams of one side in a batch of trials: candidate neurons, and which of them make each team."""

    controller: Controller
    genomes: Genomes
    indices: Indices

    def __repr__(self) -> str:
        """A line without its numbers."""
        return f"<EvolvedTeams: {len(self.indices)} trials>"

    def part(self, trials: slice) -> EvolvedTeams:
        """The teams of some trials, made of the same candidates."""
        return EvolvedTeams(self.controller, self.genomes, self.indices[trials])

    def repeated(self, n: int) -> EvolvedTeams:
        """The team of each trial ``n`` times in turn."""
        return self if n == 1 else EvolvedTeams(self.controller, self.genomes, np.repeat(self.indices, n, axis=0))


@dataclass(frozen=True)
class ScriptedTeams:
    """The same scripted policy for one side in all trials."""

    script: str

    def as_teams(self, n_trials: int) -> ScriptedTeams:  # noqa: ARG002 - it is the same in any number of them
        """The script in every trial of a batch."""
        return self

    def part(self, trials: slice) -> ScriptedTeams:  # noqa: ARG002 - likewise
        """The script in some trials."""
        return self


Teams: TypeAlias = EvolvedTeams | ScriptedTeams


class Fixed(Protocol):
    """A side that does not evolve: a script, or a team that did once."""

    def as_teams(self, n_trials: int) -> Teams:
        """It in every trial of a batch."""
        ...


@dataclass(frozen=True)
class TrialBatch:
    """Trials to play: in trial ``t`` both sides' team ``t`` meets from each of ``starts[t]``."""

    predators: Teams
    prey: Teams
    starts: np.ndarray = field(repr=False)
    """What each episode starts from: for the predator-prey world int32 ``(n_trials, n_episodes, n_agents, 2)``
    cells."""

    def part(self, trials: slice) -> TrialBatch:
        """Some of the trials."""
        return TrialBatch(self.predators.part(trials), self.prey.part(trials), self.starts[trials])


@dataclass(frozen=True)
class TrialResult:
    """What came of a batch. Agents are in order, predators first."""

    fitness: Fitness
    """``(n_trials, n_episodes, n_agents)``."""
    captured: np.ndarray
    """bool ``(n_trials, n_episodes, n_prey)``."""
    steps: np.ndarray
    """int ``(n_trials, n_episodes)``: length of each episode."""

    def __repr__(self) -> str:
        """A line without its numbers."""
        return "<TrialResult: {} trials of {} episodes>".format(*self.steps.shape)

    def fitness_of(self, role: Role) -> Fitness:
        """One side's part of the fitness: ``(n_trials, n_episodes, n_agents of the side)``."""
        n_prey = self.captured.shape[-1]
        return self.fitness[..., :-n_prey] if role == "predators" else self.fitness[..., -n_prey:]


class Starts(Protocol):
    """Where episodes can start."""

    def draw(self, generator: np.random.Generator, n_trials: int, n_episodes: int) -> np.ndarray:
        """Random starts, ``(n_trials, n_episodes, ...)``."""
        ...

    def held_out(self, generator: np.random.Generator, n_trials: int) -> np.ndarray:
        """Starts to measure on, ``(n_trials, 1, ...)``."""
        ...

    def even_predators(self, starts: np.ndarray) -> np.ndarray:
        """For each prey, how many predators start at an even distance from it, int ``(n_trials, n_episodes,
        n_prey)``.
        """
        ...


class Evaluator(Protocol):
    """Plays batches of trials. The algorithm never knows which evaluator ran."""

    @property
    def starts(self) -> Starts:
        """Where its episodes can start."""
        ...

    def evaluate(self, batch: TrialBatch) -> TrialResult:
        """Play every episode of every trial."""
        ...
