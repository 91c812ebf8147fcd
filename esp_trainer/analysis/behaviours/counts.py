"""How often each behaviour is seen in a set of episodes, and how often it would be by chance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from esp_trainer.analysis.behaviours.null import repaired
from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.behaviours.registry import BEHAVIOURS
from esp_trainer.analysis.behaviours.specialisation import NEITHER, main_roles, specialisation
from esp_trainer.analysis.behaviours.thresholds import Thresholds

_SHUFFLES = 20


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
        return self.rate if self.alone else self.rate - self.null


def over_chance(rate: np.ndarray, null: np.ndarray) -> np.ndarray:
    """Rates less the rates by chance; where chance has no meaning (nan), the rates themselves."""
    return np.where(np.isnan(null), rate, rate - null)


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
        rates[name] = BehaviourRate(_mean(seen), _mean(chance), n, alone=not detector.of_interaction)
    roles = main_roles(paths, thresholds)
    shuffled = [specialisation(generator.permuted(roles, axis=1)) for _ in range(_SHUFFLES)]
    rates["specialisation"] = BehaviourRate(
        specialisation(roles), _mean(np.array(shuffled)), int((roles != NEITHER).sum())
    )
    return rates


def _mean(values: np.ndarray) -> float:
    known = values[~np.isnan(values)]
    return float(known.mean()) if len(known) else float("nan")
