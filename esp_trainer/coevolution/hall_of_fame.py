"""The champions of past generations (section V; Rosin & Belew 1997), as many as there is room for."""

from __future__ import annotations

import numpy as np

_REMEMBERED = 0.9
"""Share of earlier results that counts on in the next generation: those who meet the champions change."""


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
        met: What is remembered of the last generations in which each champion was met: how often it won, and how often
            it was met, float64 ``(n_champions, 2)``; by default nothing.
    """

    def __init__(self, champions: np.ndarray, size: int, done: int = 0, met: np.ndarray | None = None) -> None:
        expected = len(kept_generations(done, size))
        if len(champions) != expected:
            raise ValueError(f"after {done} generations {expected} champions are kept, got {len(champions)}")
        self.champions = champions.copy()
        """All champions that are kept; read-only."""
        self.champions.flags.writeable = False
        self.met = np.zeros((expected, 2)) if met is None else met
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
        champions, met = np.concatenate([self.champions[stay], champion[None]]), np.vstack([self.met[stay], [0.0, 0.0]])
        return HallOfFame(champions, self.size, self.done + 1, met)

    def with_results(self, which: np.ndarray, won: np.ndarray) -> HallOfFame:
        """Return the hall of fame after some episodes against its champions.

        Args:
            which: Places of the champions that were met, int.
            won: How far each of them won, in [0, 1], of the same shape.
        """
        n = len(self)
        new = [np.bincount(which.ravel(), weights, n) for weights in (won.ravel(), np.ones(won.size))]
        return HallOfFame(self.champions, self.size, self.done, _REMEMBERED * self.met + np.stack(new, axis=1))

    @property
    def wins(self) -> np.ndarray:
        """How often each champion wins, in (0, 1): 0.5 for one that was not met lately."""
        return (self.met[:, 0] + 0.5) / (self.met[:, 1] + 1.0)

    def __len__(self) -> int:
        return len(self.champions)
