"""Who is measured against whom: how a peer is found, what it does, and how speeds become rows."""

from __future__ import annotations

import importlib
import os
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import chdir, contextmanager
from typing import Any, NamedTuple

from bench.page import Row
from bench.timing import side_by_side
from predprey_env import EnvConfig

CYCLES = EnvConfig().max_cycles
"""Steps of an episode, ours and theirs."""

UNIT = "steps/CPU-s"


class Scale(NamedTuple):
    """Sizes of the measurements."""

    repetitions: int
    n_episodes: int
    """That one environment plays in a run, one after the other."""
    batch_steps: int
    """Environment steps that many worlds make in a run, all together; at least one episode each."""
    most_episodes: int
    """Of a world in a run."""

    def n_calls(self, n_worlds: int) -> int:
        """Calls of ``step`` in a run of so many worlds: whole episodes, so that resets count as they occur."""
        return CYCLES * max(1, min(self.most_episodes, self.batch_steps // (CYCLES * n_worlds)))


FULL = Scale(9, 10, 310_000, 14)
QUICK = Scale(1, 1, 0, 1)
"""Enough to see that everything runs; its figures mean nothing."""


class Contender(NamedTuple):
    """Something that steps."""

    what: str
    n_agents: int
    """Agents that move in a step of one world, whoever plays them."""
    n_steps: int
    """Environment steps of a run."""
    run: Callable[[], object] | None
    """None where it is not installed."""
    against: str = ""
    """Which contender of ours it is compared with."""
    target: int | None = None
    """Steps per CPU-second that it must reach."""


def find(module: str) -> Any:
    """A module that need not be installed, or None.

    What is printed on import must not become part of a document, and PufferLib leaves a link in the working directory.
    """
    with tempfile.TemporaryDirectory() as place, chdir(place), _aside():
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
    """What calls ``step`` of many worlds so many times; they were reset, and start again by themselves."""

    def play() -> None:
        for number in range(n_calls):
            env.step(actions[number % len(actions)])

    return play


def rows_of(contenders: Sequence[Contender], repetitions: int) -> list[Row]:
    """Let those that are installed take turns, and write down all."""
    runs = {contender.what: contender.run for contender in contenders if contender.run is not None}
    taken = side_by_side(runs, repetitions)
    steps = {c.what: c.n_steps / taken[c.what].cpu for c in contenders if c.what in taken}
    n_agents = {contender.what: contender.n_agents for contender in contenders}
    return [_row(contender, steps, n_agents) for contender in contenders]


def _row(contender: Contender, steps: dict[str, float], n_agents: dict[str, int]) -> Row:
    what, against, target = contender.what, contender.against, contender.target
    if what not in steps:
        return Row(what, "not installed")
    per_second = steps[what]
    figure = f"{per_second:,.0f} {UNIT}, {per_second * contender.n_agents:,.0f} of agents"
    ratio = f"ours {_times(steps[against] / per_second)}" if against else ""
    if against and n_agents[against] != contender.n_agents:
        of_agents = steps[against] * n_agents[against] / (per_second * contender.n_agents)
        ratio += f", of agents {_times(of_agents)}"
    if target is None:
        return Row(what, figure, ratio)
    return Row(what, figure, ratio, f"≥ {target:,}", per_second >= target)


def _times(ratio: float) -> str:
    return f"{ratio:.0f} x" if ratio >= 10 else f"{ratio:.2f} x"
