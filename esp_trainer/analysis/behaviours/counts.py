"""How often each behaviour is seen in a set of episodes, and how often it would be by chance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from esp_trainer.analysis.behaviours.null import repaired
from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.behaviours.registry import BEHAVIOURS
from esp_trainer.analysis.behaviours.specialisation import NEITHER, main_roles, specialisation
from esp_trainer.analysis.behaviours.thresholds import Thresholds

_SHUFFLES = 20
_Rates = TypeVar("_Rates", float, np.ndarray)


@dataclass(frozen=True)
class BehaviourRate:
    """How often a behaviour is seen; nan for what cannot be asked."""

    rate: float
    """Mean over episodes."""

    null: float
    """Mean rate in episodes re-paired so that nobody reacts to anybody (:func:`.null.repaired`). nan for behaviours of
    one agent, and if too few episodes can be re-paired."""

    n: int
    """Episodes that the rate is a mean of; of specialisation, predators with a role."""

    alone: bool = False
    """Whether one agent does it alone, so that chance has no meaning."""

    @property
    def excess(self) -> float:
        """Rate minus the rate by chance; nan if the latter is unknown. For behaviours of one agent, the rate itself."""
        return over_chance(self.rate, self.null, alone=self.alone)


def over_chance(rate: _Rates, null: _Rates, *, alone: bool) -> _Rates:
    """Return rates minus the rates by chance, nan where the latter are unknown; ``alone``, for behaviours of one agent,
    the rates themselves.
    """
    return rate if alone else rate - null


def is_alone(name: str) -> bool:
    """Return whether one agent does a behaviour alone, so that chance has no meaning."""
    return name in BEHAVIOURS and not BEHAVIOURS[name].of_interaction


def count_behaviours(
    paths: Paths, generator: np.random.Generator, thresholds: Thresholds | None = None, pairings: int = 1
) -> dict[str, BehaviourRate]:
    """The rate of every behaviour in the registry, and ``"specialisation"`` of predators in roles.

    Args:
        paths: Episodes of the same two teams.
        generator: For the pairings of the null; the same one gives the same counts.
        thresholds: The numbers in the definitions.
        pairings: How often the null pairs episodes anew; its rates are means over all.
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


def _mean(values: np.ndarray) -> float:
    known = values[~np.isnan(values)]
    return float(known.mean()) if len(known) else float("nan")
