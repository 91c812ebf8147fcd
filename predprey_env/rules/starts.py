"""Start positions of episodes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from predprey_env.arrays import Starts
from predprey_env.config import EnvConfig
from predprey_env.jit.compilation import entry_point
from predprey_env.jit.values import Array
from predprey_env.settings import whole_numbers


def draw_starts(generator: np.random.Generator, n_starts: int, config: EnvConfig) -> Starts:
    """Sample uniform starts, int32 ``(n_starts, n_agents, 2)``: columns and rows in cells, predators first.

    With ``start_collisions="redraw"``, prey placed on a predator are placed again.
    """
    starts = generator.integers(0, config.size, size=(n_starts, config.n_agents, 2), dtype=np.int32)
    if config.start_collisions == "redraw":
        _redraw(starts, generator, config)
    return starts


def draw_each(generators: Sequence[np.random.Generator], config: EnvConfig) -> Starts:
    """Sample one start from each generator, int32 ``(n_generators, n_agents, 2)``.

    Each start is the one that :func:`draw_starts` samples from the same generator. Collisions are searched for in all
    starts at once, which is faster.
    """
    starts = np.empty((len(generators), config.n_agents, 2), np.int32)
    for start, generator in zip(starts, generators, strict=True):
        start[:] = generator.integers(0, config.size, size=(config.n_agents, 2), dtype=np.int32)
    if config.start_collisions == "redraw":
        for i in np.flatnonzero(on_a_predator(starts, config).any(axis=1)).tolist():
            _redraw(starts[i : i + 1], generators[i], config)
    return starts


def _redraw(starts: Starts, generator: np.random.Generator, config: EnvConfig) -> None:
    prey = starts[:, config.n_predators :]
    while (met := on_a_predator(starts, config)).any():  # the new place may be on a predator again
        prey[met] = generator.integers(0, config.size, size=(int(met.sum()), 2), dtype=np.int32)


def on_a_predator(starts: Starts, config: EnvConfig) -> np.ndarray:
    """Return which prey start in a predator's cell, bool ``(n_starts, n_prey)``."""
    found = np.zeros((len(starts), config.n_prey), np.bool_)
    _find_shared(starts, config.n_predators, found)
    return found


@entry_point
def _find_shared(starts: Array, n_predators: int, found: Array) -> None:
    for start in range(len(starts)):
        for prey in range(found.shape[1]):
            at = n_predators + prey
            for predator in range(n_predators):
                same_column = starts[start, predator, 0] == starts[start, at, 0]
                found[start, prey] |= same_column and starts[start, predator, 1] == starts[start, at, 1]


def given_starts(starts: object, config: EnvConfig, *n_starts: int) -> Starts:
    """Return starts that the caller chose, int32 ``(*n_starts, n_agents, 2)``.

    Raises :class:`ValueError` if they have another shape, are not integers, or lie outside the world.
    """
    cells = whole_numbers("starts", starts, (*n_starts, config.n_agents, 2))
    if cells.min() < 0 or cells.max() >= config.size:
        raise ValueError(f"starts must lie in [0, {config.size}), got {cells.min()} to {cells.max()}")
    return cells.astype(np.int32)
