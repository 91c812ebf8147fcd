"""Algorithms by name."""

from __future__ import annotations

from typing import Any, cast

from esp_trainer.algorithm import Algorithm
from predprey_env.plugins import find_class

ALGORITHMS = {
    "esp": "esp_trainer.esp.subpopulations:Subpopulations",
    "cosyne": "esp_trainer.algorithms.cosyne:Cosyne",
    "ga": "esp_trainer.algorithms.genetic:GeneticAlgorithm",
    "openai_es": "esp_trainer.algorithms.openai_es:OpenAIES",
    "cma_es": "esp_trainer.algorithms.ask_tell:CmaES",
}
"""Name -> class of each algorithm that ships, as ``module:Class``."""

_CALLS = ("start", "ask", "tell", "spread", "burst", "state", "restore")


def algorithm_class(name: str) -> type[Algorithm]:
    """Return the class of an algorithm by its name in :data:`ALGORITHMS`, or as ``module:Class``.

    Raises :class:`ValueError`, in one line, if there is none, or if it does not follow the protocol.
    """
    found = find_class("algorithm", name, ALGORITHMS)
    abstract: frozenset[str] = getattr(found, "__abstractmethods__", frozenset())
    missing = [call for call in _CALLS if not callable(getattr(found, call, None)) or call in abstract]
    missing += sorted(abstract.difference(_CALLS))
    if missing:
        raise ValueError(f"algorithm {name} has no {' and no '.join(f'{call}()' for call in missing)}")
    return cast("type[Algorithm]", found)


def algorithm_name(algorithm: Any) -> str:
    """Return the name under which a config finds the algorithm of an object."""
    kind = type(algorithm)
    place = f"{kind.__module__}:{kind.__qualname__}"
    return next((name for name, known in ALGORITHMS.items() if known == place), place)
