"""Choice of the champions of a generation.

The best of a thousand six-episode scores is mostly luck. By default the best twenty teams of each side therefore play
each other again on fresh starts; with ``champion.n_past`` they also play past champions. The team with the best mean
becomes champion.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from esp_trainer.arrays import Fitness, TeamGenomes
from esp_trainer.coevolution.episodes import play_batch
from esp_trainer.config import ChampionConfig
from esp_trainer.esp.team import as_candidates, gather_genomes, in_every_trial
from esp_trainer.networks.controller import Controller
from esp_trainer.types import ROLES, Evaluator, EvolvedTeams, Fixed, Role, TeamBatch, TrialBatch
from predprey_env.agents import other_team


@dataclass(frozen=True)
class Contenders:
    """The best teams of one side's trials, best first."""

    controller: Controller = field(repr=False)
    genomes: TeamGenomes = field(repr=False)
    """float32 ``(n_teams, n_agents, n_networks, n_hidden, n_genes)``, copied."""
    scores: Fitness = field(repr=False)
    """Fitness of each team in its trial, mean over agents, ``(n_teams,)``."""
    trials: np.ndarray = field(repr=False)
    """Index of each team's trial, int ``(n_teams,)``."""

    def as_teams(self, which: np.ndarray) -> EvolvedTeams:
        """Return a batch in which trial ``t`` has team ``which[t]``; ``which`` is int ``(n_trials,)``."""
        indices = np.broadcast_to(which[:, None, None, None], (len(which), *self.genomes.shape[1:4]))
        return EvolvedTeams(self.controller, as_candidates(self.genomes), indices)


@dataclass(frozen=True)
class Champion:
    """The best team of one side in a generation."""

    controller: Controller = field(repr=False)
    genomes: TeamGenomes = field(repr=False)
    """float32 ``(n_agents, n_networks, n_hidden, n_genes)``."""
    score: float
    """Mean fitness against all contenders of the other side and past champions, or in its trial (``argmax``)."""
    trial: int
    """Index of the trial that the team is from."""

    def as_teams(self, n_trials: int) -> EvolvedTeams:
        """Repeat the champion for each trial of a batch."""
        return in_every_trial(self.controller, self.genomes, n_trials)


def best_teams(teams: EvolvedTeams, fitness: Fitness, n_teams: int) -> Contenders:
    """Return the teams with the highest ``fitness``, ``(n_trials, n_agents)``, averaged over agents."""
    scores = fitness.mean(axis=1)
    best = np.argsort(-scores, kind="stable")[:n_teams]
    return Contenders(teams.controller, gather_genomes(teams, best), scores[best], best)


def choose_champions(
    contenders: Mapping[Role, Contenders],
    config: ChampionConfig,
    evaluator: Evaluator,
    generator: np.random.Generator,
    past: Mapping[Role, EvolvedTeams] = MappingProxyType({}),
    fixed: Mapping[Role, Fixed] = MappingProxyType({}),
) -> dict[Role, Champion]:
    """Return the champion of each evolving side.

    Each side has contenders or is fixed. ``past`` maps a side to past champions of the other side, which its
    contenders also play.
    """
    if config.method == "argmax":
        return {role: _champion(c, 0, float(c.scores[0])) for role, c in contenders.items()}
    counts = [len(contenders[role].scores) if role in contenders else 1 for role in ROLES]
    which = dict(zip(ROLES, np.indices(counts).reshape(2, -1), strict=True))
    teams: dict[Role, TeamBatch] = {role: side.as_teams(len(which[role])) for role, side in fixed.items()}
    teams |= {role: side.as_teams(which[role]) for role, side in contenders.items()}
    # A fixed side is one opponent: play as many episodes against it as against n_candidates contenders.
    n_episodes = config.n_episodes * (config.n_candidates if fixed else 1)
    starts = evaluator.starts.draw(generator, len(which["prey"]), n_episodes)
    result = play_batch(evaluator, TrialBatch(teams["predators"], teams["prey"], starts))

    champions: dict[Role, Champion] = {}
    for role, side in contenders.items():
        earned = np.moveaxis(result.fitness_of(role).mean(axis=(1, 2)).reshape(counts), ROLES.index(role), 0)
        if role in past:
            against_past = _meet_past(role, side, past[role], config.n_episodes, evaluator, generator)
            earned = np.concatenate([earned, against_past], axis=1)
        scores = earned.mean(axis=1)
        best = int(scores.argmax())
        champions[role] = _champion(side, best, float(scores[best]))
    return champions


def _champion(side: Contenders, place: int, score: float) -> Champion:
    return Champion(side.controller, side.genomes[place], score, int(side.trials[place]))


def _meet_past(
    role: Role,
    side: Contenders,
    past: EvolvedTeams,
    n_episodes: int,
    evaluator: Evaluator,
    generator: np.random.Generator,
) -> Fitness:
    """Return the mean fitness of each contender against each past champion, ``(n_teams, n_past)``."""
    which, met = np.indices((len(side.scores), len(past.indices))).reshape(2, -1)
    opponents = EvolvedTeams(past.controller, past.genomes, past.indices[met])
    teams: dict[Role, TeamBatch] = {role: side.as_teams(which), other_team(role): opponents}

    # All contenders meet a past champion from the same starts, so that their scores can be compared.
    starts = evaluator.starts.draw(generator, len(past.indices), n_episodes)[met]
    result = play_batch(evaluator, TrialBatch(teams["predators"], teams["prey"], starts))
    return result.fitness_of(role).mean(axis=(1, 2)).reshape(len(side.scores), -1)
