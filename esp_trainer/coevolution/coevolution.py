"""One generation of two coevolving sides."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from copy import deepcopy
from time import perf_counter
from typing import NamedTuple

import numpy as np

from esp_trainer.algorithm import Algorithm, Spread
from esp_trainer.algorithms.registry import algorithm_name, failures_told
from esp_trainer.arrays import EpisodeStarts, TeamGenomes
from esp_trainer.coevolution.champions import Champion, Contenders, best_teams, choose_champions
from esp_trainer.coevolution.episodes import play_batch
from esp_trainer.coevolution.generation import Bred, Generation
from esp_trainer.coevolution.hall_of_fame import HallOfFame
from esp_trainer.coevolution.opponents import CHOICES, past_teams
from esp_trainer.coevolution.sides import EvolvingSide, Side, new_sides
from esp_trainer.coevolution.trials import Part, Trials, by_block, centred, ranked, summarise_trials
from esp_trainer.config import RunConfig
from esp_trainer.esp.signal import Signal, ties
from esp_trainer.esp.subpopulations import Parents, Subpopulations
from esp_trainer.seeding import stream
from esp_trainer.statistics import Captures, Payoffs, summarise
from esp_trainer.types import Evaluator, EvolvedTeams, Fixed, Role, TeamBatch, TrialBatch
from predprey_env.agents import other_team
from predprey_env.settings import PartError


class Exploiter(NamedTuple):
    """The champion of a population that evolved against one team alone."""

    genomes: TeamGenomes
    """float32 ``(n_agents, n_networks, n_hidden, n_genes)``."""
    payoff: float
    """Mean payoff to the predators when the exploiter met that team, from held-out starts."""


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
        """Number of generations played."""
        return next(iter(self.evolving.values())).hall_of_fame.done

    @property
    def evolving(self) -> dict[Role, EvolvingSide]:
        """The sides that evolve."""
        return {role: side for role, side in self.sides.items() if isinstance(side, EvolvingSide)}

    @property
    def fixed(self) -> dict[Role, Fixed]:
        """The side that does not evolve, if there is one."""
        return {role: side for role, side in self.sides.items() if not isinstance(side, EvolvingSide)}

    def step(self, number: int) -> Generation:
        """Play a generation and continue with the sides that it bred."""
        generation, self.sides = self.play(number)
        return generation

    def play(self, number: int) -> tuple[Generation, dict[Role, Side]]:
        """Play, score, choose champions and breed. Return the generation and the sides that it bred.

        This object does not change until the caller sets :attr:`sides`, so a generation that fails can be played again.
        """
        begun = perf_counter()
        populations = {role: deepcopy(side.algorithm) for role, side in self.evolving.items()}
        if self.config.genealogy:
            _keep_parents(populations)
        asked = {role: self._asked(role, each, number) for role, each in populations.items()}
        asked_at = perf_counter()
        parts = self._play_trials(asked, number)
        trials = {role: summarise_trials(own, self.config.esp) for role, own in parts.items()}
        fames = {role: _remember(side.hall_of_fame, role, parts) for role, side in self.evolving.items()}
        del parts  # frees most of the memory of a generation with many trials
        played = perf_counter()
        champions = self._choose(asked, trials, number)
        chosen = perf_counter()
        held_out = self._measure(champions)
        measured = perf_counter()
        exploiters = {role: self._exploiter(role, champions, number) for role in self._exploiting(number)}
        exploited = perf_counter()
        spreads = {role: _spread(each) for role, each in populations.items()}
        sides, signals = self.sides.copy(), {}
        bred: dict[Role, Bred] = {}
        for role, population in populations.items():
            before, breeding = self.evolving[role], self._stream(f"{role} breeding", number)
            with failures_told(algorithm_name(population), "tell()"):
                share = population.tell(trials[role].earned, before.hall_of_fame.champions, breeding)
            signals[role] = Signal(float("nan") if share is None else share, ties(trials[role].fitness))
            fame = fames[role].with_champion(champions[role].genomes)
            if role in exploiters:
                fame = fame.with_guest(exploiters[role].genomes)
            sides[role] = after = self._bred(before, population, fame, champions[role], breeding)
            if isinstance(population, Subpopulations) and population.parents:
                champion = asked[role].indices[champions[role].trial].reshape(-1)
                bred[role] = Bred(_by_generation(population.parents, before), champion, burst=after.best == -np.inf)
                population.parents = None
        seconds = {
            "trials": played - asked_at,
            "champions": chosen - played,
            "held_out": measured - chosen,
            "breeding": (perf_counter() - exploited) + (asked_at - begun),
        }
        payoffs = {role: each.payoff for role, each in exploiters.items()}
        if self.config.esp.exploiters_every:
            seconds["exploiters"] = exploited - measured
        return Generation(number, trials, champions, spreads, signals, held_out, seconds, payoffs, bred), sides

    def _asked(self, role: Role, population: Algorithm, number: int) -> EvolvedTeams:
        """Return the teams of a side's trials; raise :class:`PartError` unless there is one for each."""
        with failures_told(algorithm_name(population), "ask()"):
            teams = population.ask(self._stream(f"{role} ask", number))
        n_teams = len(teams.indices) if isinstance(teams, EvolvedTeams) else None
        if n_teams != self.config.esp.n_trials:
            got = type(teams).__name__ if n_teams is None else f"of {n_teams}"
            raise PartError(
                f"algorithm {algorithm_name(population)}: ask() must return EvolvedTeams of {self.config.esp.n_trials} "
                f"trials, got {got}"
            )
        return teams

    def _exploiting(self, number: int) -> Collection[Role]:
        """Return the sides that get an exploiter after a generation."""
        every = self.config.esp.exploiters_every
        return self.evolving if every and not self.fixed and (number + 1) % every == 0 else ()

    def _exploiter(self, role: Role, champions: Mapping[Role, Champion], number: int) -> Exploiter:
        """Evolve a fresh population of one side against the other side's champion alone; return its best champion."""
        opponent = other_team(role)
        seed = int(self._stream(f"{role} exploiter", number).integers(2**63))
        alone = {"past_share": 0.0, "past_each_episode": False, "exploiters_every": 0, "burst_after": 0}
        config = self.config.replace(
            seed=seed,
            genealogy=False,
            esp=self.config.esp.replace(**alone),
            champion=self.config.champion.replace(n_past=0),
        )
        run = Coevolution(config, {**new_sides(config), opponent: champions[opponent]}, self.evaluator)
        generations = map(run.step, range(config.esp.exploiter_generations))
        found = [Exploiter(each.champions[role].genomes, each.held_out.payoff.rate) for each in generations]
        return max(found, key=lambda each: each.payoff if role == "predators" else -each.payoff)

    def _stream(self, purpose: str, number: int) -> np.random.Generator:
        return stream(self.config.seed, purpose, number)

    def _play_trials(self, asked: dict[Role, EvolvedTeams], number: int) -> dict[Role, list[Part]]:
        """Play every evolving side's trials, against the other side's teams and against its past champions."""
        esp = self.config.esp
        # There are no past champions in the first generation, and none of a script.
        n_past = esp.n_past if all(map(self._has_past, asked)) else 0
        n_blocks, n_present = -(-esp.n_trials // esp.block_size), esp.n_episodes - n_past
        drawn = self.evaluator.starts.draw(self._stream("starts", number), n_blocks, esp.n_episodes)
        starts = by_block(drawn, esp.block_size, esp.n_trials)
        parts: dict[Role, list[Part]] = {role: [] for role in asked}
        if n_present:
            both = self._with_fixed(asked, esp.n_trials)
            result = play_batch(self.evaluator, self._batch(both, starts[:, :n_present]))
            for role, own in parts.items():
                own.append(Part.of(result, role, both[other_team(role)]))
        if n_past:
            for role, teams in asked.items():
                parts[role].append(self._meet_past(role, teams, starts[:, n_present:], number))
        return parts

    def _meet_past(self, role: Role, teams: EvolvedTeams, starts: EpisodeStarts, number: int) -> Part:
        """Play one side's teams, from ``starts`` ``(n_trials, n_episodes, ...)``, against past champions."""
        esp, other = self.config.esp, self.evolving[other_team(role)]
        n_trials, n_episodes = starts.shape[:2]
        n_each = n_episodes if esp.past_each_episode else 1
        generator = self._stream(f"{role} opponents", number)
        shape = -(-n_trials // esp.block_size), n_each
        chosen = by_block(CHOICES[esp.past_choice](other.hall_of_fame, shape, generator), esp.block_size, n_trials)
        opponents = past_teams(other.algorithm.controller, other.hall_of_fame, chosen.ravel())
        # With a champion for each episode, each episode is a trial of its own for the evaluator.
        apart = starts.reshape(n_trials * n_each, -1, *starts.shape[2:])
        result = play_batch(
            self.evaluator, self._batch({role: teams.repeated(n_each), other_team(role): opponents}, apart)
        )
        return Part.of(result, role, opponents, np.broadcast_to(chosen, (n_trials, n_episodes)))

    def _with_fixed(self, evolved: Mapping[Role, TeamBatch], n_trials: int) -> dict[Role, TeamBatch]:
        return {**{role: side.as_teams(n_trials) for role, side in self.fixed.items()}, **evolved}

    def _batch(self, teams: dict[Role, TeamBatch], starts: EpisodeStarts) -> TrialBatch:
        return TrialBatch(teams["predators"], teams["prey"], starts)

    def _choose(self, asked: dict[Role, EvolvedTeams], trials: dict[Role, Trials], number: int) -> dict[Role, Champion]:
        settings = self.config.champion
        contenders: dict[Role, Contenders] = {}
        for role, teams in asked.items():
            fitness = centred(trials[role].fitness, self.config.esp.block_size)
            contenders[role] = best_teams(teams, fitness, settings.n_candidates)
        met = filter(self._has_past, asked) if settings.n_past else ()
        past = {role: self._past(role, settings.n_past, number) for role in met}
        generator = self._stream("champions", number)
        return choose_champions(contenders, settings, self.evaluator, generator, past, self.fixed)

    def _has_past(self, role: Role) -> bool:
        """Return whether a side's opponents have past champions."""
        other = self.sides[other_team(role)]
        return isinstance(other, EvolvingSide) and len(other.hall_of_fame) > 0

    def _past(self, role: Role, n: int, number: int) -> EvolvedTeams:
        """Return the past champions of the other side that a side's candidates play."""
        other = self.evolving[other_team(role)]
        generator = self._stream(f"{role} candidates' opponents", number)
        chosen = CHOICES[self.config.esp.past_choice](other.hall_of_fame, (n,), generator)
        return past_teams(other.algorithm.controller, other.hall_of_fame, chosen)

    def _bred(
        self,
        before: EvolvingSide,
        population: Algorithm,
        fame: HallOfFame,
        champion: Champion,
        generator: np.random.Generator,
    ) -> EvolvingSide:
        """Return a side after its generation.

        The side starts again around the champion if the highest champion score has not risen for ``burst_after``
        generations.
        """
        best, stagnant = before.best, before.stagnant + 1
        if champion.score > best:
            best, stagnant = champion.score, 0
        if self.config.esp.burst_after and stagnant >= self.config.esp.burst_after:
            with failures_told(algorithm_name(population), "burst()"):
                population.burst(champion.genomes, generator)
            best, stagnant = -np.inf, 0
        return EvolvingSide(population, fame, best, stagnant)

    def _measure(self, champions: dict[Role, Champion]) -> Captures | Payoffs:
        n = len(self._held_out)
        teams = self._with_fixed({role: champion.as_teams(n) for role, champion in champions.items()}, n)
        result = play_batch(self.evaluator, self._batch(teams, self._held_out))
        return summarise(result, self._even)


def _spread(population: Algorithm) -> Spread:
    with failures_told(algorithm_name(population), "spread()"):
        return population.spread()


def _keep_parents(populations: Mapping[Role, Algorithm]) -> None:
    """Have all populations keep the parents of their neurons; raise :class:`ValueError` if one cannot."""
    for role, population in populations.items():
        if not isinstance(population, Subpopulations):
            raise ValueError(f"genealogy must be false: the {role} are bred by {type(population).__name__}, not by esp")
        population.keeps_parents = True


def _by_generation(parents: Parents, side: EvolvingSide) -> Parents:
    """Return the parents with past champions named by their generation instead of their place in the hall of fame."""
    fame = side.hall_of_fame
    own = np.append(fame.generations[len(fame.guests) :], -1)  # the last, for place -1, is none
    return parents._replace(past=own[parents.past])


def _remember(fame: HallOfFame, role: Role, parts: dict[Role, list[Part]]) -> HallOfFame:
    """Return a side's hall of fame with the results of the other side's trials against its champions."""
    for part in parts.get(other_team(role), []):
        if part.past is not None:
            won = part.payoff if part.is_share else ranked(part.payoff)
            fame = fame.with_results(part.past, won if role == "predators" else 1.0 - won)
    return fame
