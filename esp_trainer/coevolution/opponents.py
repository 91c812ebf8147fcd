"""Whom the teams of a generation meet."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from esp_trainer.esp.team import as_candidates
from esp_trainer.types import EvolvedTeams

if TYPE_CHECKING:
    from esp_trainer.coevolution.hall_of_fame import HallOfFame
    from esp_trainer.esp.subpopulations import Subpopulations


def previous_champion(side: Subpopulations, fame: HallOfFame, n_trials: int, _: np.random.Generator) -> EvolvedTeams:
    """The last champion, in every trial."""
    return _of_fame(side, fame, np.full(n_trials, len(fame) - 1))


def hall_of_fame(side: Subpopulations, fame: HallOfFame, n_trials: int, generator: np.random.Generator) -> EvolvedTeams:
    """A uniformly drawn past champion in each trial."""
    return _of_fame(side, fame, generator.integers(0, len(fame), n_trials))


def mixed(side: Subpopulations, fame: HallOfFame, n_trials: int, generator: np.random.Generator) -> EvolvedTeams:
    """In each trial, as a coin falls, a team drawn from the subpopulations or a past champion."""
    drawn, famous = side.draw(generator, n_trials), hall_of_fame(side, fame, n_trials, generator)
    coin = generator.random(n_trials) < 0.5
    behind = famous.indices + drawn.genomes.shape[3]
    return EvolvedTeams(
        side.controller,
        np.concatenate([drawn.genomes, famous.genomes], axis=3),
        np.where(coin[:, None, None, None], drawn.indices, behind),
    )


OPPONENTS = {"previous_champion": previous_champion, "hall_of_fame": hall_of_fame, "mixed": mixed}
"""The pairings in which each side has trials of its own, by name."""


def _of_fame(side: Subpopulations, fame: HallOfFame, which: np.ndarray) -> EvolvedTeams:
    members, positions = np.unique(which, return_inverse=True)
    genomes = as_candidates(fame.champions[members])
    indices = np.broadcast_to(positions[:, None, None, None], (len(which), *genomes.shape[:3]))
    return EvolvedTeams(side.controller, genomes, indices)
