"""Hall of fame: champions of past generations (section V; Rosin & Belew 1997), up to a maximum size, and guests."""

from __future__ import annotations

import numpy as np

from esp_trainer.arrays import Fractions, GenerationIndices, MemberIndices, TeamGenomes
from predprey_env.settings import counted

_REMEMBERED = 0.9
"""Factor on earlier results in each generation: they count less and less, as the opponents of the champions change."""


def kept_generations(done: int, size: int) -> GenerationIndices:
    """Return the generations whose champions are kept after ``done`` generations: at most ``size``, in order.

    All are kept while there is room; then every second, every fourth and so on, and always the last. So a full hall of
    fame still reaches back evenly to the beginning. The champions that it holds depend on the two arguments alone.
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
    """An immutable pool of one side's champions, for opponents to play.

    The first members are guests, which always stay: exploiters, and champions of other runs. Then come the run's own
    champions of the generations that :func:`kept_generations` returns, in order. A member's place is its index among
    the members.

    Args:
        champions: The champions of ``kept_generations(done, size)``, float32
            ``(n_champions, n_agents, n_networks, n_hidden, n_genes)``; copied.
        size: Largest number of champions that are kept, at least 2.
        done: Number of generations so far.
        met: Wins and episodes of each member, float64 ``(n_members, 2)``; earlier ones count less. By default zeros.
        guests: Teams of other populations, float32 ``(n_guests, n_agents, n_networks, n_hidden, n_genes)``, or None.
    """

    def __init__(
        self,
        champions: TeamGenomes,
        size: int,
        done: int = 0,
        met: np.ndarray | None = None,
        guests: TeamGenomes | None = None,
    ) -> None:
        expected = len(kept_generations(done, size))
        if len(champions) != expected:
            raise ValueError(f"{expected} champions are kept of {counted(done, 'generation')}, got {len(champions)}")
        self.champions = champions.copy()
        """The run's own champions that are kept; read-only."""
        self.champions.flags.writeable = False
        self.guests = np.empty((0, *champions.shape[1:]), np.float32) if guests is None else guests
        if self.guests.shape[1:] != champions.shape[1:]:
            raise ValueError(f"a guest must have shape {champions.shape[1:]}, got {self.guests.shape[1:]}")
        self.met = np.zeros((len(self), 2)) if met is None else met
        self.size = size
        self.done = done

    @property
    def generations(self) -> GenerationIndices:
        """Generation of each member; 0 for guests."""
        return np.append(np.zeros(len(self.guests), int), kept_generations(self.done, self.size))

    def with_champion(self, champion: TeamGenomes) -> HallOfFame:
        """Return the hall of fame after one more generation.

        The generation's champion is ``(n_agents, n_networks, n_hidden, n_genes)``.
        """
        if champion.shape != self.champions.shape[1:]:
            raise ValueError(f"a champion must have shape {self.champions.shape[1:]}, got {champion.shape}")
        before, after = (kept_generations(done, self.size) for done in (self.done, self.done + 1))
        stay = np.searchsorted(before, after[:-1])
        champions = np.concatenate([self.champions[stay], champion[None]])
        n_guests = len(self.guests)
        met = np.vstack([self.met[:n_guests], self.met[n_guests:][stay], [0.0, 0.0]])
        return HallOfFame(champions, self.size, self.done + 1, met, self.guests)

    def with_guest(self, guest: TeamGenomes) -> HallOfFame:
        """Return the hall of fame with one more guest, ``(n_agents, n_networks, n_hidden, n_genes)``."""
        n_guests = len(self.guests)
        guests, met = np.concatenate([self.guests, guest[None]]), np.insert(self.met, n_guests, 0.0, axis=0)
        return HallOfFame(self.champions, self.size, self.done, met, guests)

    def with_results(self, which: MemberIndices, won: Fractions) -> HallOfFame:
        """Return the hall of fame with the results of some episodes against its members.

        Args:
            which: Place of the member in each episode, int.
            won: Result of this member, from 0 (lost) to 1 (won), of the same shape.
        """
        n = len(self)
        new = [np.bincount(which.ravel(), weights, n) for weights in (won.ravel(), np.ones(won.size))]
        met = _REMEMBERED * self.met + np.stack(new, axis=1)
        return HallOfFame(self.champions, self.size, self.done, met, self.guests)

    def members(self, places: MemberIndices) -> TeamGenomes:
        """Return the genomes of the members in some places, int ``(n,)`` in ascending order."""
        n_guests = len(self.guests)
        own = np.searchsorted(places, n_guests)  # guests come first; copies no other members
        return np.concatenate([self.guests[places[:own]], self.champions[places[own:] - n_guests]])

    @property
    def wins(self) -> Fractions:
        """Estimated win rate of each member, in (0, 1); 0.5 for a member without recent episodes."""
        return (self.met[:, 0] + 0.5) / (self.met[:, 1] + 1.0)

    def __len__(self) -> int:
        """Return the number of members, guests included."""
        return len(self.guests) + len(self.champions)
