"""The champions of past generations (section V; Rosin & Belew 1997), as many as there is room for."""

from __future__ import annotations

import numpy as np


def kept_generations(done: int, size: int) -> np.ndarray:
    """The generations whose champions are kept after ``done`` of them, at most ``size``, in order.

    All while there is room; then every second, every fourth and so on, and always the last. So a hall of fame that is
    full still reaches back evenly to the beginning, and which champions it holds follows from its length alone.
    """
    if done < 0:
        raise ValueError(f"generations must be at least 0, got {done}")
    stride = 1
    while -(-done // stride) + _last_is_extra(stride, done) > size:
        stride *= 2
    every = np.arange(0, done, stride)
    return np.append(every, done - 1) if _last_is_extra(stride, done) else every


def _last_is_extra(stride: int, done: int) -> bool:
    return (done - 1) % stride != 0


class HallOfFame:
    """Champion teams in order of generation; see :func:`kept_generations` for whose.

    Args:
        champions: Those of ``kept_generations(done, size)``, float32
            ``(n_champions, n_agents, n_networks, n_hidden, n_genes)``; copied.
        size: The most that are kept, at least 2.
        done: Generations so far.
    """

    def __init__(self, champions: np.ndarray, size: int, done: int = 0) -> None:
        self.size = size
        self.done = done
        self._store = champions.copy()
        self._n = len(champions)
        if self._n != len(self.generations):
            raise ValueError(f"after {done} generations {len(self.generations)} champions are kept, got {self._n}")

    @property
    def champions(self) -> np.ndarray:
        """All that are kept, read-only; good until the next is added."""
        view = self._store[: self._n]
        view.flags.writeable = False
        return view

    @property
    def generations(self) -> np.ndarray:
        """Whose they are."""
        return kept_generations(self.done, self.size)

    def add(self, champion: np.ndarray) -> None:
        """Take in a champion team ``(n_agents, n_networks, n_hidden, n_genes)``."""
        if champion.shape != self._store.shape[1:]:
            raise ValueError(f"a champion must have shape {self._store.shape[1:]}, got {champion.shape}")
        before = self.generations
        self.done += 1
        stay = np.searchsorted(before, self.generations[:-1])
        self._n = len(stay)
        if self._n and stay[-1] >= self._n:  # some in between go
            self._store[: self._n] = self._store[stay]
        if self._n == len(self._store):
            room = np.empty((max(16, 2 * self._n), *self._store.shape[1:]), self._store.dtype)
            room[: self._n] = self._store
            self._store = room
        self._store[self._n] = champion
        self._n += 1

    def __len__(self) -> int:
        return self._n
