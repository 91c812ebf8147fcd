"""Algorithms by name."""

from __future__ import annotations

import traceback
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

import numpy as np

from esp_trainer.algorithm import Algorithm
from esp_trainer.arrays import StoredArray
from predprey_env.plugins import find_class
from predprey_env.settings import PartError, error_line

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

    Raises :class:`ValueError`, in one line, if there is no such class or it does not follow the protocol.
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


@contextmanager
def failures_told(name: str, call: str) -> Iterator[None]:
    """Convert an exception in a user's algorithm to a :class:`PartError`, in one line with the place of the error."""
    try:
        yield
    except (PartError, MemoryError):
        raise
    except Exception as error:
        if name in ALGORITHMS:
            raise
        last = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{Path(last.filename).name}, line {last.lineno}"
        raise PartError(f"algorithm {name} failed in {call}: {error_line(error)} ({where})") from error


def state_of(algorithm: Algorithm) -> dict[str, StoredArray]:
    """Return the state of an algorithm; raise :class:`PartError` if it holds anything but numbers and arrays of them.

    Numbers become arrays ``()``.
    """
    kind = algorithm_name(algorithm)
    with failures_told(kind, "state()"):
        state = algorithm.state()
    needed = f"algorithm {kind}: state() must return numbers, or arrays of them, by name"
    if not isinstance(state, Mapping):
        raise PartError(f"{needed}, got {type(state).__name__}")
    arrays = {}
    for name, value in state.items():
        if not isinstance(name, str):
            raise PartError(f"{needed}, got the name {name!r}")
        array = np.asarray(value) if isinstance(value, (np.ndarray, np.generic, int, float)) else None
        if array is None or array.dtype.kind not in "biuf":
            got = f"an array of {array.dtype}" if isinstance(value, np.ndarray) else type(value).__name__
            raise PartError(f"{needed}, got {got} as {name}")
        arrays[name] = array
    return arrays


def check_restores(algorithm: Algorithm, fresh: Algorithm) -> None:
    """Raise :class:`PartError` unless an algorithm is the same after a checkpoint: its run could not be resumed.

    Args:
        algorithm: The algorithm.
        fresh: Another one of its kind, started from other random numbers. It restores the state of the first.
    """
    kind, state = algorithm_name(algorithm), state_of(algorithm)
    with failures_told(kind, "restore()"):
        fresh.restore(state)
    restored = state_of(fresh)
    for name, array in state.items():
        if name not in restored or not np.array_equal(array, restored[name], equal_nan=array.dtype.kind == "f"):
            raise PartError(f"algorithm {kind}: restore() must restore what state() returned, but {name} differs then")
