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
    """Champion teams in order of generation, never changed; :func:`kept_generations` says which generations.

    Args:
        champions: The champions of ``kept_generations(done, size)``, float32
            ``(n_champions, n_agents, n_networks, n_hidden, n_genes)``; copied.
        size: The most champions that are kept, at least 2.
        done: Generations so far.
    """

    def __init__(self, champions: np.ndarray, size: int, done: int = 0) -> None:
        expected = len(kept_generations(done, size))
        if len(champions) != expected:
            raise ValueError(f"after {done} generations {expected} champions are kept, got {len(champions)}")
        self.champions = champions.copy()
        """All champions that are kept; read-only."""
        self.champions.flags.writeable = False
        self.size = size
        self.done = done

    @property
    def generations(self) -> np.ndarray:
        """The generation of each champion."""
        return kept_generations(self.done, self.size)

    def with_champion(self, champion: np.ndarray) -> HallOfFame:
        """Return the hall of fame after one more generation; its champion is ``(n_agents, n_networks, n_hidden,
        n_genes)``.
        """
        if champion.shape != self.champions.shape[1:]:
            raise ValueError(f"a champion must have shape {self.champions.shape[1:]}, got {champion.shape}")
        generations = kept_generations(self.done + 1, self.size)
        stay = np.searchsorted(self.generations, generations[:-1])
        return HallOfFame(np.concatenate([self.champions[stay], champion[None]]), self.size, self.done + 1)

    def __len__(self) -> int:
        return len(self.champions)
