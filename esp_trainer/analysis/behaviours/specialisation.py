"""Whether the same predators always take the same roles."""

from __future__ import annotations

import numpy as np

from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.behaviours.roles import attacks, blocks
from esp_trainer.analysis.behaviours.thresholds import Thresholds

ATTACKER, BLOCKER, NEITHER = 0, 1, 2


def main_roles(paths: Paths, thresholds: Thresholds) -> np.ndarray:
    """The role that each predator has for more rows of an episode, int ``(n_episodes, n_predators)``."""
    rows = [role(paths, thresholds).any(axis=3).sum(axis=1) for role in (attacks, blocks)]
    return np.where(rows[0] > rows[1], ATTACKER, np.where(rows[1] > rows[0], BLOCKER, NEITHER))


def specialisation(roles: np.ndarray) -> float:
    """How much of a predator's role is known from which predator it is, over a set of episodes: in [0, 1].

    "the predators initially evolve rigid role-based behaviors in which some of them act as attackers and others as
    blockers" (VII). The mutual information of index and role over the entropy of the role (Theil's uncertainty
    coefficient, 1970), over predators that attack or block: 1 where each always takes the same role, 0 where all take
    them as often. nan where all that have a role have the same. By chance it is a little more than 0.

    Args:
        roles: Of each predator in each episode, as :func:`main_roles` gives them.
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
