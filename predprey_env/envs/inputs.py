"""Checks of an environment's inputs; each raises :class:`ValueError` for an input that cannot be used."""

from __future__ import annotations

from collections.abc import Sequence
from operator import index
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from predprey_env.arrays import Actions, WorldIndices
from predprey_env.settings import counted, plain, whole_number, whole_numbers

_MODES = {mode.value.lower(): mode for mode in AutoresetMode}


def read_mode(given: AutoresetMode | str) -> AutoresetMode:
    """Return the mode with a name: ``"SameStep"``, the value in Gymnasium's enum, or ``"SAME_STEP"``, the enum's own
    name.
    """
    if isinstance(given, AutoresetMode):
        return given
    mode = _MODES.get(given.replace("_", "").lower()) if isinstance(given, str) else None
    if mode is None:
        known = ", ".join(mode.value for mode in AutoresetMode)
        raise ValueError(f"autoreset_mode must be one of {known}, got {given!r}")
    return mode


def read_n_worlds(n_worlds: int | None, num_envs: int | None) -> int:
    """Return the number of worlds, given under exactly one of its two names."""
    given = [number for number in (n_worlds, num_envs) if number is not None]
    if len(given) != 1:
        got = "neither" if not given else f"{n_worlds!r} and {num_envs!r}"
        raise ValueError(f"n_worlds or num_envs, its other name, must be given, but not both, got {got}")
    return whole_number("n_worlds" if num_envs is None else "num_envs", given[0], 1)


def read_actions(actions: Any, n_worlds: int, n_agents: int, n_actions: int) -> Actions:
    """Return the rows' actions, integers ``(n_worlds * n_agents,)``, as int32 ``(n_worlds, n_agents)``."""
    chosen = whole_numbers("actions", actions, (n_worlds * n_agents,))
    if chosen.min() < 0 or chosen.max() >= n_actions:
        raise ValueError(f"actions must be in 0..{n_actions - 1}, got {chosen.min()} to {chosen.max()}")
    return np.ascontiguousarray(chosen, np.int32).reshape(n_worlds, n_agents)


def read_mask(mask: object, n_worlds: int, n_rows: int) -> WorldIndices:
    """Return the indices of the worlds whose rows a reset mask marks, or of all worlds without a mask."""
    if mask is None:
        return np.arange(n_worlds)
    marked = np.asarray(mask)
    if marked.shape != (n_rows,) or marked.dtype != np.bool_:
        raise ValueError(f"reset_mask must be bool of shape ({n_rows},), got {marked.dtype} of shape {marked.shape}")
    by_world = marked.reshape(n_worlds, -1)
    if (by_world.any(axis=1) != by_world.all(axis=1)).any():
        raise ValueError("reset_mask must mark all agents of a world or none, as they end together")
    return np.flatnonzero(by_world[:, 0])


def read_seed(seed: object) -> int | None:
    """Return a seed as a Python integer, or None if there is none. True is 1, as in Gymnasium."""
    return None if seed is None else index(plain(seed))


def read_seeds(seed: int | Sequence[int | None] | None, n_worlds: int) -> list[int | None]:
    """Return a seed for each world, None for a world without one."""
    seed = plain(seed)
    if isinstance(seed, Sequence | np.ndarray):
        seeds = [read_seed(each) for each in seed]
    else:
        first = read_seed(seed)
        seeds = [None if first is None else first + world for world in range(n_worlds)]
    if len(seeds) != n_worlds:
        raise ValueError(f"seed must be an integer or one for each of {counted(n_worlds, 'world')}, got {len(seeds)}")
    return seeds
