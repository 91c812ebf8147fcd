"""The champions of every generation so far (section V; Rosin & Belew 1997)."""

from __future__ import annotations

import numpy as np


class HallOfFame:
    """Champion teams in order of generation; what comes in is copied and never changes.

    Args:
        champions: float32 ``(n_champions, n_agents, n_networks, n_hidden, n_genes)``.
    """

    def __init__(self, champions: np.ndarray) -> None:
        self._store = champions.copy()
        self._n = len(champions)

    @property
    def champions(self) -> np.ndarray:
        """All of them, read-only."""
        view = self._store[: self._n]
        view.flags.writeable = False
        return view

    def add(self, champion: np.ndarray) -> None:
        """Take in a champion team ``(n_agents, n_networks, n_hidden, n_genes)``."""
        if champion.shape != self._store.shape[1:]:
            raise ValueError(f"a champion must have shape {self._store.shape[1:]}, got {champion.shape}")
        if self._n == len(self._store):
            room = np.empty((max(16, 2 * self._n), *self._store.shape[1:]), self._store.dtype)
            room[: self._n] = self._store
            self._store = room
        self._store[self._n] = champion
        self._n += 1

    def __len__(self) -> int:
        return self._n
