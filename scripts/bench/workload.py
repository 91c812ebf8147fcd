"""Amount of work to measure, and the trials of one generation, sampled as the trainer samples them."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np

from esp_trainer.coevolution.sides import EvolvingSide, new_sides
from esp_trainer.config import RunConfig
from esp_trainer.esp.team import Team, gather_genomes
from esp_trainer.evaluation.starts import CellStarts
from esp_trainer.presets import preset
from esp_trainer.seeding import stream
from esp_trainer.types import EvolvedTeams, Role, TrialBatch

PRESET = "paper-3v2"


class TrainerScale(NamedTuple):
    """Sizes of the measurements."""

    n_trials: int
    n_episodes: int
    repetitions: int
    reference_trials: int
    """Number of trials, of one episode each, that the reference evaluator plays."""
    env_steps: int
    generations: int
    warm_generations: int
    memory_generations: int


FULL = TrainerScale(1000, 6, 9, 16, 20_000, 40, 5, 40)
QUICK = TrainerScale(32, 2, 1, 2, 300, 4, 1, 2)
"""Enough to see that everything runs; its figures mean nothing."""


def config_of(scale: TrainerScale, output: Literal["logistic", "linear"] = "logistic") -> RunConfig:
    """Return the preset at a scale; at full scale it is the preset itself, but for the activation of the outputs."""
    whole = preset(PRESET)
    return whole.replace(
        esp=whole.esp.replace(n_trials=scale.n_trials, n_episodes=scale.n_episodes),
        predators=whole.predators.replace(output=output),
        prey=whole.prey.replace(output=output),
    )


def first_generation(config: RunConfig) -> TrialBatch:
    """Return the trials of a run's first generation: teams from random subpopulations, random starts."""
    esp, teams = config.esp, dict[Role, EvolvedTeams]()
    for role, side in new_sides(config).items():
        if not isinstance(side, EvolvingSide):
            raise ValueError(f"{role} must evolve, got a script")
        teams[role] = side.algorithm.draw(stream(config.seed, f"{role} ask"), esp.n_trials)
    starts = CellStarts(config.env).draw(stream(config.seed, "starts"), esp.n_trials, esp.n_episodes)
    return TrialBatch(teams["predators"], teams["prey"], starts)


def random_team(role: Role) -> Team:
    """Return a team of the preset's first generation: random networks, as evolution starts from them."""
    config = config_of(QUICK)
    batch = first_generation(config)
    teams = {"predators": batch.predators, "prey": batch.prey}[role]
    if not isinstance(teams, EvolvedTeams):
        raise ValueError(f"{role} must evolve, got a script")
    side = {"predators": config.predators, "prey": config.prey}[role]
    return Team(role, side, teams.controller, gather_genomes(teams, np.arange(1))[0])
