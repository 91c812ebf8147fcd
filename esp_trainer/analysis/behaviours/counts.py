"""Rates of the behaviours in a set of episodes, and their rates by chance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from esp_trainer.analysis.behaviours.null import repaired
from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.behaviours.registry import BEHAVIOURS
from esp_trainer.analysis.behaviours.specialisation import NEITHER, main_roles, specialisation
from esp_trainer.analysis.behaviours.thresholds import Thresholds
from esp_trainer.arrays import Fractions

_SHUFFLES = 20
_Rates = TypeVar("_Rates", float, np.ndarray)


@dataclass(frozen=True)
class BehaviourRate:
    """The rate of a behaviour, and its rate by chance."""

    rate: float
    """Mean over episodes; nan if the behaviour is not defined for the teams, for example if it needs more agents."""

    null: float
    """Mean rate by chance, in re-paired episodes in which agents do not react to each other (:func:`.null.repaired`).
    nan for behaviours of a single agent, and if too few episodes can be re-paired."""

    n: int
    """Number of episodes that the rate is a mean of. For specialisation: number of predators with a role, summed over
    episodes."""

    alone: bool = False
    """True for a behaviour of a single agent, for which a rate by chance has no meaning."""

    @property
    def excess(self) -> float:
        """Rate minus the rate by chance; nan if the latter is unknown. For behaviours of a single agent, the rate."""
        return over_chance(self.rate, self.null, alone=self.alone)


def over_chance(rate: _Rates, null: _Rates, *, alone: bool) -> _Rates:
    """Return rates minus the rates by chance, nan where the latter are unknown; with ``alone``, only the rates."""
    return rate if alone else rate - null


def is_alone(name: str) -> bool:
    """Return whether a behaviour is one of a single agent, for which a rate by chance has no meaning."""
    return name in BEHAVIOURS and not BEHAVIOURS[name].of_interaction


def count_behaviours(
    paths: Paths, generator: np.random.Generator, thresholds: Thresholds | None = None, pairings: int = 1
) -> dict[str, BehaviourRate]:
    """Return the rate of every behaviour in the registry, and of ``"specialisation"``, that of predators in roles.

    Args:
        paths: Paths of episodes of the same two teams.
        generator: Random generator of the pairings of the null. The same state gives the same rates.
        thresholds: Thresholds of the definitions.
        pairings: Number of times that the null re-pairs the episodes; its rates are means over all of them.
    """
    thresholds = thresholds or Thresholds()
    nulls = [repaired(paths, generator) for _ in range(pairings)]
    rates = {}
    for name, detector in BEHAVIOURS.items():
        seen = detector(paths, thresholds)
        chance = np.concatenate([detector(null, thresholds) for null in nulls]) if detector.of_interaction else seen[:0]
        n = int((~np.isnan(seen)).sum())
        rates[name] = BehaviourRate(_mean(seen), _mean(chance), n, alone=is_alone(name))
    roles = main_roles(paths, thresholds)
    shuffled = [specialisation(generator.permuted(roles, axis=1)) for _ in range(_SHUFFLES)]
    rates["specialisation"] = BehaviourRate(
        specialisation(roles), _mean(np.array(shuffled)), int((roles != NEITHER).sum())
    )
    return rates


def _mean(values: Fractions) -> float:
    known = values[~np.isnan(values)]
    return float(known.mean()) if len(known) else float("nan")
