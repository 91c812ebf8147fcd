"""Opponent pools: the past champions that the teams of a generation meet."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from esp_trainer.coevolution.hall_of_fame import HallOfFame
from esp_trainer.esp.team import as_candidates
from esp_trainer.types import Controller, EvolvedTeams

Shape = tuple[int, ...]
Choice = Callable[[HallOfFame, Shape, np.random.Generator], np.ndarray]
"""Draws places in a hall of fame: int, of that shape."""

_LEAST_WEIGHT = 0.02
"""Weight of a champion that always wins or always loses, beside 0.25 of one that does as often as not: even they must
be met now and then, as what they are worth changes."""


def uniform(fame: HallOfFame, shape: Shape, generator: np.random.Generator) -> np.ndarray:
    """Any member."""
    return generator.integers(0, len(fame), shape)


def recent(fame: HallOfFame, shape: Shape, generator: np.random.Generator) -> np.ndarray:
    """A later champion more often, in proportion to its generation. Guests count as generation 0."""
    return _weighted(fame.generations + 1.0, shape, generator)


def latest(fame: HallOfFame, shape: Shape, _: np.random.Generator) -> np.ndarray:
    """The last champion; before there is one, the last guest."""
    return np.full(shape, len(fame) - 1)


def spread(fame: HallOfFame, shape: Shape, generator: np.random.Generator) -> np.ndarray:
    """Champions of every strength equally often: the one whose rate of winning is next to a uniform number."""
    order = np.argsort(fame.wins, kind="stable")
    between = (fame.wins[order][1:] + fame.wins[order][:-1]) / 2
    return np.asarray(order[np.searchsorted(between, generator.random(shape))])


def contested(fame: HallOfFame, shape: Shape, generator: np.random.Generator) -> np.ndarray:
    """A champion that wins as often as it loses most often: with weight p (1 - p), p being how often it wins."""
    return _weighted(np.maximum(fame.wins * (1 - fame.wins), _LEAST_WEIGHT), shape, generator)


CHOICES: dict[str, Choice] = {
    "uniform": uniform,
    "recent": recent,
    "latest": latest,
    "spread": spread,
    "contested": contested,
}
"""By the names that ``esp.past_choice`` has for them."""


def past_teams(controller: Controller, fame: HallOfFame, which: np.ndarray) -> EvolvedTeams:
    """The members in some places of a hall of fame, int ``(n_trials,)``, as the teams of a batch."""
    members, positions = np.unique(which, return_inverse=True)
    genomes = as_candidates(fame.members(members))
    indices = np.broadcast_to(positions[:, None, None, None], (len(which), *genomes.shape[:3]))
    return EvolvedTeams(controller, genomes, indices)


def _weighted(weights: np.ndarray, shape: Shape, generator: np.random.Generator) -> np.ndarray:
    ends = np.cumsum(weights)
    which = np.searchsorted(ends, generator.random(shape) * ends[-1], side="right")
    return np.asarray(np.minimum(which, len(weights) - 1))
