"""Coevolution of predator and prey teams by Enforced SubPopulations (Rawal, Rajagopalan & Miikkulainen 2010).

Evolve both teams, and play the last champions against each other::

    >>> from esp_trainer import FusedEvaluator, History, match, preset
    >>> config = preset("smoke").replace(generations=3)
    >>> history = History.evolve(config, FusedEvaluator(config.env))
    >>> predators, prey = (history.team(role, generation=2) for role in ("predators", "prey"))
    >>> captures = match(predators, prey, config.env, n_episodes=200)
    >>> 0 <= captures.caught.rate <= 1
    True

Teams that ship with the package are policies for any environment of :mod:`predprey_env`::

    >>> from esp_trainer import load_team
    >>> load_team("paper-3v2/prey/seed-500-late")
    <Team: 2 prey, split networks, preset paper-3v2, seed 500, generation 408>
"""

from __future__ import annotations

import importlib
import warnings
from typing import TYPE_CHECKING, Any

from esp_trainer.config import RunConfig
from esp_trainer.esp.team import Team
from esp_trainer.presets import PRESETS, preset
from esp_trainer.tasks import WORLDS
from esp_trainer.teams import load_team, load_zoo

if TYPE_CHECKING:
    from esp_trainer.analysis.cross_play import own_cross_play
    from esp_trainer.analysis.history import History
    from esp_trainer.benchmark.batched import BatchedPolicy, SB3Policy, TorchPolicy
    from esp_trainer.benchmark.gauntlet import Gauntlet
    from esp_trainer.benchmark.match import Arena
    from esp_trainer.coevolution.coevolution import Coevolution
    from esp_trainer.coevolution.sides import new_sides
    from esp_trainer.esp.subpopulations import Subpopulations
    from esp_trainer.evaluation.fused import FusedEvaluator
    from esp_trainer.evaluation.match import match
    from esp_trainer.evaluation.registry import make_evaluator
    from esp_trainer.exact.response import exploitability_of
    from esp_trainer.exact.solution import solve

__all__ = [
    "PRESETS",
    "WORLDS",
    "Arena",
    "BatchedPolicy",
    "Coevolution",
    "FusedEvaluator",
    "Gauntlet",
    "History",
    "RunConfig",
    "SB3Policy",
    "Subpopulations",
    "Team",
    "TorchPolicy",
    "exploitability_of",
    "load_team",
    "load_zoo",
    "make_evaluator",
    "match",
    "new_sides",
    "own_cross_play",
    "preset",
    "solve",
]

# Imported when first used: the kernel and the analysis take a second to import, and loading a team needs neither.
_LATER = {
    "Arena": "benchmark.match",
    "BatchedPolicy": "benchmark.batched",
    "Coevolution": "coevolution.coevolution",
    "FusedEvaluator": "evaluation.fused",
    "Gauntlet": "benchmark.gauntlet",
    "History": "analysis.history",
    "SB3Policy": "benchmark.batched",
    "Subpopulations": "esp.subpopulations",
    "TorchPolicy": "benchmark.batched",
    "exploitability_of": "exact.response",
    "make_evaluator": "evaluation.registry",
    "match": "evaluation.match",
    "new_sides": "coevolution.sides",
    "own_cross_play": "analysis.cross_play",
    "solve": "exact.solution",
}
"""Name -> module that defines it."""


def __getattr__(name: str) -> Any:
    if name == "TASKS":
        words = "esp_trainer.TASKS is now esp_trainer.WORLDS, and goes in 0.4.0"
        warnings.warn(words, DeprecationWarning, stacklevel=2)
        return WORLDS
    if name not in _LATER:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_LATER[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
