"""Algorithms that breed the teams of a side: ESP, four others, and any class that follows the protocol.

The config names one per side, ``predators.algorithm`` and ``prey.algorithm``.
"""

from esp_trainer.algorithm import Algorithm, Spread
from esp_trainer.algorithms.registry import ALGORITHMS, algorithm_class
from esp_trainer.algorithms.whole_teams import WholeTeams

__all__ = ["ALGORITHMS", "Algorithm", "Spread", "WholeTeams", "algorithm_class"]
