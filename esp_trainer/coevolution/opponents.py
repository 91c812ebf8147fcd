"""Opponent pools: the choice of past champions that the teams of a generation play."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from esp_trainer.arrays import MemberIndices
from esp_trainer.coevolution.hall_of_fame import HallOfFame
from esp_trainer.esp.team import as_candidates
from esp_trainer.networks.controller import Controller
from esp_trainer.types import EvolvedTeams

Shape = tuple[int, ...]
Choice = Callable[[HallOfFame, Shape, np.random.Generator], MemberIndices]
"""Function that samples places in a hall of fame, int, of a given shape."""

_LEAST_WEIGHT = 0.02
"""Smallest weight of a champion; one that wins half of its episodes has 0.25. Even a champion that always wins or
always loses must be played now and then, because its win rate changes."""

_LEAST_HARD = 1e-4
"""Smallest weight of a champion in :func:`hard`; one that always wins has 1. Even hundreds of champions that always
lose should seldom be sampled."""


def sample_uniform(fame: HallOfFame, shape: Shape, generator: np.random.Generator) -> MemberIndices:
    """Sample all members with the same probability."""
    return generator.integers(0, len(fame), shape)


def recent(fame: HallOfFame, shape: Shape, generator: np.random.Generator) -> MemberIndices:
    """Sample members in proportion to their generation plus 1. Guests count as generation 0."""
    return _weighted(fame.generations + 1.0, shape, generator)


def latest(fame: HallOfFame, shape: Shape, _: np.random.Generator) -> MemberIndices:
    """Return the last champion; before the first champion, the last guest."""
    return np.full(shape, len(fame) - 1)


def sample_spread(fame: HallOfFame, shape: Shape, generator: np.random.Generator) -> MemberIndices:
    """Sample champions of all strengths equally often: the one whose win rate is nearest to a uniform random number."""
    order = np.argsort(fame.wins, kind="stable")
    between = (fame.wins[order][1:] + fame.wins[order][:-1]) / 2
    return order[np.searchsorted(between, generator.random(shape))]


def contested(fame: HallOfFame, shape: Shape, generator: np.random.Generator) -> MemberIndices:
    """Sample members with weight p (1 - p) for win rate p: most often those that win as often as they lose."""
    return _weighted(np.maximum(fame.wins * (1 - fame.wins), _LEAST_WEIGHT), shape, generator)


def hard(fame: HallOfFame, shape: Shape, generator: np.random.Generator) -> MemberIndices:
    """Sample members with weight p² for win rate p: mostly those that are hardest to beat (prioritised fictitious
    self-play, Vinyals et al., Nature 575, 2019).
    """
    return _weighted(np.maximum(fame.wins**2, _LEAST_HARD), shape, generator)


CHOICES: dict[str, Choice] = {
    "uniform": sample_uniform,
    "recent": recent,
    "latest": latest,
    "spread": sample_spread,
    "contested": contested,
    "hard": hard,
}
"""Value of ``esp.past_choice`` -> function."""


def past_teams(controller: Controller, fame: HallOfFame, which: MemberIndices) -> EvolvedTeams:
    """Return the members in some places of a hall of fame, int ``(n_trials,)``, as the teams of a batch."""
    members, positions = np.unique(which, return_inverse=True)
    genomes = as_candidates(fame.members(members))
    indices = np.broadcast_to(positions[:, None, None, None], (len(which), *genomes.shape[:3]))
    return EvolvedTeams(controller, genomes, indices)


def _weighted(weights: np.ndarray, shape: Shape, generator: np.random.Generator) -> MemberIndices:
    """Sample indices of weights, with probabilities in proportion to them."""
    ends = np.cumsum(weights)
    # random() is at most 1 - 2**-53, so the product is rounded to less than the whole sum.
    return np.searchsorted(ends, generator.random(shape) * ends[-1], side="right")
