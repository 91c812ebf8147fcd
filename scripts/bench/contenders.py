"""Contenders of the comparison with peers: how each is found, what it does, and how speeds become rows."""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np

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
    """The contender of ours that it is compared with."""
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


class LoopedEnvs:
    """A parallel environment for each world, stepped in a loop: as little as it takes to fill arrays, by agent."""

    def __init__(self, envs: Sequence[Any]) -> None:
        self._envs = envs
        self._agents = envs[0].possible_agents

    def reset(self, *, seed: int) -> tuple[Any, dict[str, Any]]:
        """Start world ``w`` from the seed ``seed + w``."""
        return self._together([env.reset(seed=seed + world)[0] for world, env in enumerate(self._envs)]), {}

    def step(self, actions: Any) -> tuple[Any, ...]:
        """Step all worlds, which start again in the step in which they end."""
        told = []
        for env, row in zip(self._envs, self._by_world(actions), strict=True):
            observations, *results, _ = env.step(dict(zip(self._agents, row, strict=True)))
            if not env.agents:
                observations, _ = env.reset()
            told.append((observations, *results))
        return tuple(self._together(each) for each in zip(*told, strict=True))

    def _by_world(self, actions: Any) -> Any:
        return zip(*(actions[agent].tolist() for agent in self._agents), strict=True)

    def _together(self, worlds: Any) -> Any:
        return {agent: np.array([world[agent] for world in worlds]) for agent in self._agents}


def check_same(what: str, other: Any, ours: Any, actions: Sequence[Any]) -> None:
    """Raise :class:`RuntimeError` unless another plays as ours does, from the same seeds, for more than an episode."""
    same, n_ended = _same(other.reset(seed=0)[0], ours.reset(seed=0)[0]), 0
    for number in range(MAX_CYCLES + 20):
        theirs, expected = (env.step(actions[number % len(actions)]) for env in (other, ours))
        same = same and all(_same(a, b) for a, b in zip(theirs[:4], expected[:4], strict=True))
        n_ended += sum(int(np.sum(ended)) for each in expected[2:4] for ended in _parts(each).values())
    if not same or not n_ended:
        raise RuntimeError(f"{what} must play as {type(ours).__name__} does: same {same}, {n_ended} ends")


def _same(theirs: Any, ours: Any) -> bool:
    theirs, ours = _parts(theirs), _parts(ours)
    return all(np.allclose(theirs[part], ours[part], rtol=1e-6, atol=0.0) for part in ours)


def _parts(told: Any) -> Mapping[str, np.ndarray]:
    """Return arrays by agent, or the only one."""
    return told if isinstance(told, Mapping) else {"": told}


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
