"""Who is measured against whom: how a peer is found, what it does, and how speeds become rows."""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

from bench.page import Row
from bench.timing import side_by_side
from predprey_env import EnvConfig

MAX_CYCLES = EnvConfig().max_cycles
"""Steps of an episode, ours and theirs."""


class PeerScale(NamedTuple):
    """Sizes of the measurements."""

    repetitions: int
    n_episodes: int
    """Episodes that one environment plays in a run, one after the other."""
    batch_steps: int
    """Environment steps that many worlds make in a run, all together; at least one episode each."""
    most_episodes: int
    """Most episodes of a world in a run."""

    def n_calls(self, n_worlds: int) -> int:
        """Return the calls of ``step`` in a run: whole episodes, so that resets count as they occur."""
        return MAX_CYCLES * max(1, min(self.most_episodes, self.batch_steps // (MAX_CYCLES * n_worlds)))


FULL = PeerScale(9, 10, 310_000, 14)
QUICK = PeerScale(1, 1, 0, 1)
"""Enough to see that everything runs; its figures mean nothing."""


class Contender(NamedTuple):
    """Something that steps."""

    what: str
    n_steps: int
    """Environment steps of a run."""
    run: Callable[[], object] | None
    """None where it is not installed."""
    against: str = ""
    """Which contender of ours it is compared with."""
    target: int | None = None
    """Steps per CPU-second that it must reach."""


def find(module: str) -> Any:
    """Return a module that need not be installed, or None."""
    with _aside():
        try:
            return importlib.import_module(module)
        except ImportError:
            return None


@contextmanager
def _aside() -> Iterator[None]:
    """Send what is printed to the error stream, even by JaxMARL, which looks for the real output."""
    sys.stdout.flush()
    real = os.dup(1)
    os.dup2(2, 1)
    try:
        yield
    finally:
        sys.stdout.flush()
        os.dup2(real, 1)
        os.close(real)


def check_plays(what: str, n_ended: int, n_caught: int) -> None:
    """Raise :class:`RuntimeError` for a contender that is fast because nothing happens in it."""
    if n_ended < 1 or n_caught < 1:
        raise RuntimeError(f"{what} must end episodes and catch, got {n_ended} ends and {n_caught} catches")


def stepping_all(env: Any, actions: Sequence[Any], n_calls: int) -> Callable[[], None]:
    """Return what calls ``step`` of many worlds so many times; they were reset, and start again by themselves."""

    def play() -> None:
        for number in range(n_calls):
            env.step(actions[number % len(actions)])

    return play


def rows_of(contenders: Sequence[Contender], repetitions: int) -> list[Row]:
    """Let those that are installed take turns; return a row for each contender."""
    runs = {contender.what: contender.run for contender in contenders if contender.run is not None}
    taken = side_by_side(runs, repetitions)
    speed = {each.what: each.n_steps / taken[each.what].cpu for each in contenders if each.what in taken}
    rows = []
    for what, _, _, against, target in contenders:
        if what not in speed:
            rows.append(Row(what, "not installed"))
            continue
        ratio = f"ours {speed[against] / speed[what]:.3g} x" if against else ""
        met = (f"≥ {target:,}", speed[what] >= target) if target else ()
        rows.append(Row(what, f"{speed[what]:,.0f} steps/CPU-s", ratio, *met))
    return rows
