"""The registry of behaviours: the detector of each by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from esp_trainer.analysis.behaviours import evasion, idling, roles, surrounding, two_prey
from esp_trainer.analysis.behaviours.detection import rows_of
from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.behaviours.thresholds import Thresholds
from esp_trainer.arrays import BoolMask, Fractions
from esp_trainer.types import Role


@dataclass(frozen=True)
class Detector:
    """A detector of a behaviour in episodes."""

    rule: Callable[[Paths, Thresholds], BoolMask | Fractions]
    """Definition of the behaviour: a function that returns the rows at which it is seen, bool ``(n_episodes, n_rows)``,
    or a number per episode, float ``(n_episodes,)``."""

    meaning: str
    """Description in one line."""

    who: Role
    """Side that shows the behaviour."""

    min_predators: int = 1
    """Minimum number of predators; with fewer, the behaviour is not defined."""

    min_prey: int = 1
    """Minimum number of prey; with fewer, the behaviour is not defined."""

    of_interaction: bool = True
    """True for a behaviour of agents towards each other, for which a rate without interaction has a meaning."""

    def is_defined(self, n_predators: int, n_prey: int) -> bool:
        """Return whether there are enough agents for the behaviour."""
        return n_predators >= self.min_predators and n_prey >= self.min_prey

    def rows(self, paths: Paths) -> BoolMask:
        """Return the rows at which the behaviour is seen, bool ``(n_episodes, n_rows)``.

        If the rule gives a number per episode, the last row of each episode with a number above 0 is marked. No row is
        marked if there are too few agents.
        """
        if not self.is_defined(paths.n_predators, paths.n_prey):
            return np.zeros(paths.valid.shape, bool)
        found = self.rule(paths, Thresholds())
        if found.ndim == 2:
            return found
        return (np.nan_to_num(found)[:, None] > 0) & (np.arange(paths.n_rows) == paths.lengths[:, None])

    def __call__(self, paths: Paths, thresholds: Thresholds | None = None) -> Fractions:
        """Return a number per episode, float ``(n_episodes,)``: 1 if the behaviour is seen, 0 if not, or a fraction.

        It is nan where the behaviour is not defined, for example with too few agents.
        """
        if not self.is_defined(paths.n_predators, paths.n_prey):
            return np.full(paths.n_episodes, np.nan)
        found = self.rule(paths, thresholds or Thresholds())
        return np.asarray(found.any(axis=1), float) if found.ndim == 2 else found


BEHAVIOURS: dict[str, Detector] = {
    "attacker": Detector(rows_of(roles.attacker), "a predator chases a prey", "predators"),
    "blocker": Detector(rows_of(roles.blocker), "a predator keeps to a place to which a prey runs", "predators"),
    "role switch": Detector(rows_of(roles.role_switch), "a blocker attacks, or an attacker blocks", "predators"),
    "opposing attack": Detector(
        rows_of(roles.opposing_attack), "two attackers come from opposing sides", "predators", min_predators=2
    ),
    "encirclement": Detector(
        rows_of(surrounding.encirclement), "three predators close in with the prey inside", "predators", min_predators=3
    ),
    "circling": Detector(
        rows_of(evasion.circling), "a prey goes round in a small circle, a predator on its tail", "prey"
    ),
    "baiting": Detector(
        rows_of(evasion.baiting), "a prey waits for two predators to converge, and leaves", "prey", min_predators=2
    ),
    "sidestepping": Detector(rows_of(evasion.sidestepping), "a prey steps aside and passes a blocker", "prey"),
    "reversal": Detector(
        rows_of(evasion.reversal), "a prey between predators turns round and gains distance", "prey", min_predators=2
    ),
    "herding": Detector(
        rows_of(two_prey.herding), "two prey are driven together", "predators", min_predators=2, min_prey=2
    ),
    "simultaneous capture": Detector(
        rows_of(two_prey.simultaneous_capture), "two prey are caught within a few steps", "predators", min_prey=2
    ),
    "scattering": Detector(
        rows_of(two_prey.scattering),
        "two prey part before predators that converge",
        "prey",
        min_predators=2,
        min_prey=2,
    ),
    "idling": Detector(idling.idling, "fraction of predators' steps that are idle", "predators", of_interaction=False),
    "parity idle": Detector(
        idling.parity_idle,
        "fraction of captures by a predator that idled an odd number of times",
        "predators",
        of_interaction=False,
    ),
}
