"""One generation of two coevolving sides."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np

from esp_trainer.coevolution.champions import Champion, Contenders, best_teams, choose_champions
from esp_trainer.coevolution.episodes import play
from esp_trainer.coevolution.opponents import OPPONENTS
from esp_trainer.coevolution.sharing import share
from esp_trainer.coevolution.sides import EvolvingSide, Side
from esp_trainer.config import RunConfig
from esp_trainer.esp.signal import Signal
from esp_trainer.esp.subpopulations import Spread, Subpopulations
from esp_trainer.seeding import stream
from esp_trainer.statistics import Captures, count_captures
from esp_trainer.types import (
    ROLES,
    Evaluator,
    EvolvedTeams,
    Fitness,
    Fixed,
    Role,
    Teams,
    TrialBatch,
    TrialResult,
)
from predprey_env.policies.names import other_team


@dataclass(frozen=True)
class Trials:
    """What one side's trials brought."""

    fitness: Fitness = field(repr=False)
    """Each agent's mean over the episodes, ``(n_trials, n_agents)``."""
    caught: float
    """Share of prey caught."""
    opponents: Teams
    """The opponent of each trial."""


@dataclass(frozen=True)
class Generation:
    """What a generation brought."""

    number: int
    trials: dict[Role, Trials]
    champions: dict[Role, Champion]
    spreads: dict[Role, Spread]
    """Of the subpopulations that its teams were drawn from."""
    signals: dict[Role, Signal]
    """What selection had to go by."""
    held_out: Captures
    """Champion against champion, or against the fixed side, from the held-out starts."""
    seconds: dict[str, float]
    """Wall time by phase."""


class Coevolution:
    """Two sides, at least one of which evolves, and the evaluator that plays them."""

    def __init__(self, config: RunConfig, sides: dict[Role, Side], evaluator: Evaluator) -> None:
        self.config = config
        self.sides = sides
        self.evaluator = evaluator
        self._held_out = evaluator.starts.held_out(stream(config.seed, "held-out"), config.champion.n_held_out)
        self._even = evaluator.starts.even_predators(self._held_out)

    @property
    def done(self) -> int:
        """Generations so far."""
        return next(iter(self.evolving.values())).hall_of_fame.done

    @property
    def evolving(self) -> dict[Role, EvolvingSide]:
        """The sides that evolve."""
        return {role: side for role, side in self.sides.items() if isinstance(side, EvolvingSide)}

    @property
    def fixed(self) -> dict[Role, Fixed]:
        """The side that does not, if there is one."""
        return {role: side for role, side in self.sides.items() if not isinstance(side, EvolvingSide)}

    def step(self, number: int) -> Generation:
        """Play a generation and go on with the sides that it bred."""
        generation, self.sides = self.play(number)
        return generation

    def play(self, number: int) -> tuple[Generation, dict[Role, Side]]:
        """Play, score, choose champions and breed; return the generation and the sides that it bred.

        Nothing here changes before the caller sets :attr:`sides`: a generation that fails can be played again.
        """
        begun = perf_counter()
        populations = {role: deepcopy(side.subpopulations) for role, side in self.evolving.items()}
        asked = {role: each.ask(self._stream(f"{role} ask", number)) for role, each in populations.items()}
        asked_at = perf_counter()
        trials = self._play_trials(asked, number)
        played = perf_counter()
        champions = self._choose(asked, trials, number)
        chosen = perf_counter()
        held_out = self._measure(champions)
        measured = perf_counter()
        spreads = {role: each.spread() for role, each in populations.items()}
        sides, signals = self.sides.copy(), {}
        for role, population in populations.items():
            before, breeding = self.evolving[role], self._stream(f"{role} breeding", number)
            signal = population.tell(self._earned(trials[role]), before.hall_of_fame.champions, breeding)
            if signal is not None:  # an algorithm of somebody's own need not say
                signals[role] = signal
            sides[role] = self._bred(before, population, champions[role], breeding)
        seconds = {
            "trials": played - asked_at,
            "champions": chosen - played,
            "held_out": measured - chosen,
            "breeding": (perf_counter() - measured) + (asked_at - begun),
        }
        return Generation(number, trials, champions, spreads, signals, held_out, seconds), sides

    def _stream(self, purpose: str, number: int) -> np.random.Generator:
        return stream(self.config.seed, purpose, number)

    def _play_trials(self, asked: dict[Role, EvolvedTeams], number: int) -> dict[Role, Trials]:
        """Every evolving side's trials. Where teams are sampled together, the same episodes score both."""
        esp = self.config.esp
        starts = self.evaluator.starts.draw(self._stream("starts", number), esp.n_trials, esp.n_episodes)
        meets_champions = esp.pairing != "cosample" and number > 0 and len(asked) == len(ROLES)
        if not meets_champions:
            both = self._with_fixed(asked, esp.n_trials)
            result = play(self.evaluator, self._batch(both, starts))
            return {role: self._trials(result, role, both[other_team(role)]) for role in asked}
        trials: dict[Role, Trials] = {}
        for role, teams in asked.items():
            other = other_team(role)
            side = self.evolving[other]
            draw = self._stream(f"{role} opponents", number)
            opponents = OPPONENTS[esp.pairing](side.subpopulations, side.hall_of_fame, esp.n_trials, draw)
            result = play(self.evaluator, self._batch({role: teams, other: opponents}, starts))
            trials[role] = self._trials(result, role, opponents)
        return trials

    def _with_fixed(self, evolved: Mapping[Role, Teams], n_trials: int) -> dict[Role, Teams]:
        return {**{role: side.as_teams(n_trials) for role, side in self.fixed.items()}, **evolved}

    def _batch(self, teams: dict[Role, Teams], starts: np.ndarray) -> TrialBatch:
        return TrialBatch(teams["predators"], teams["prey"], starts)

    def _trials(self, result: TrialResult, role: Role, opponents: Teams) -> Trials:
        return Trials(result.fitness_of(role).mean(axis=1), float(result.captured.mean()), opponents)

    def _earned(self, trials: Trials) -> Fitness:
        return share(trials.fitness, trials.opponents) if self.config.esp.fitness_sharing else trials.fitness

    def _choose(self, asked: dict[Role, EvolvedTeams], trials: dict[Role, Trials], number: int) -> dict[Role, Champion]:
        settings = self.config.champion
        contenders: dict[Role, Contenders | Fixed] = {**self.fixed}
        for role, teams in asked.items():
            contenders[role] = best_teams(teams, trials[role].fitness, settings.n_candidates)
        return choose_champions(contenders, settings, self.evaluator, self._stream("champions", number))

    def _bred(
        self, before: EvolvingSide, population: Subpopulations, champion: Champion, generator: np.random.Generator
    ) -> EvolvingSide:
        """A side after its generation: its new population, which starts again around the champion if none has scored
        higher for long.
        """
        best, stagnant = before.best, before.stagnant + 1
        if champion.score > best:
            best, stagnant = champion.score, 0
        if self.config.esp.burst_after and stagnant >= self.config.esp.burst_after:
            population.burst(champion.genomes, generator)
            best, stagnant = -np.inf, 0
        return EvolvingSide(population, before.hall_of_fame.with_champion(champion.genomes), best, stagnant)

    def _measure(self, champions: dict[Role, Champion]) -> Captures:
        n = len(self._held_out)
        teams = self._with_fixed({role: champion.as_teams(n) for role, champion in champions.items()}, n)
        result = play(self.evaluator, self._batch(teams, self._held_out))
        return count_captures(result, self._even, self.config.env.n_predators)
