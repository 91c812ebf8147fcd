"""Specialisation of predators: to what extent the same predators always take the same roles."""

from __future__ import annotations

import numpy as np

from esp_trainer.analysis.behaviours.detection import detected
from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.behaviours.thresholds import Thresholds

ATTACKER, BLOCKER, NEITHER = 0, 1, 2


def main_roles(paths: Paths, thresholds: Thresholds) -> np.ndarray:
    """Return the role that each predator has for more rows of an episode, int ``(n_episodes, n_predators)``.

    It is ``NEITHER`` if the predator has both roles for equally many rows, or none.
    """
    found = detected(paths, thresholds).episodes
    attacking, blocking = (role.any(axis=3).sum(axis=1) for role in (found.attacks, found.blocks))
    return np.where(attacking > blocking, ATTACKER, np.where(blocking > attacking, BLOCKER, NEITHER))


def specialisation(roles: np.ndarray) -> float:
    """Return to what extent a predator's index determines its role over a set of episodes, in [0, 1].

    "the predators initially evolve rigid role-based behaviors in which some of them act as attackers and others as
    blockers" (VII). This is the mutual information of index and role divided by the entropy of the role (Theil's
    uncertainty coefficient, 1970), over predators that attack or block. It is 1 if each predator always takes the same
    role, 0 if all take the roles equally often, and nan unless both roles occur. By chance it is slightly above 0.

    Args:
        roles: Role of each predator in each episode, int ``(n_episodes, n_predators)``, from :func:`main_roles`.
    """
    counts = np.array([[(column == role).sum() for role in (ATTACKER, BLOCKER)] for column in roles.T], float)
    whole = _entropy(counts.sum(axis=0))
    if not whole > 0:
        return float("nan")
    within = sum(row.sum() * _entropy(row) for row in counts) / counts.sum()
    return float(1 - within / whole)


def _entropy(counts: np.ndarray) -> float:
    shares = counts[counts > 0] / max(counts.sum(), 1)
    return float(-(shares * np.log(shares)).sum())
