"""Steps per CPU-second through PettingZoo's parallel API, with random actions that were drawn before."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from bench.page import Row
from bench.timing import side_by_side
from bench.workload import Scale
from predprey_env import parallel_env


class Prebuilt:
    """As little as an environment can do: five dictionaries copied from ready ones, and an info for each agent."""

    def __init__(self, like: Any) -> None:
        self.agents = self.possible_agents = like.possible_agents
        self.action_space = like.action_space
        self._observations, self._infos = like.reset(seed=0)
        self._rewards = dict.fromkeys(self.agents, 0.0)
        self._flags = dict.fromkeys(self.agents, False)

    def reset(self, **_options: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """The same at every call."""
        return dict(self._observations), dict(self._infos)

    def step(self, _actions: dict[str, int]) -> tuple[dict[str, Any], ...]:
        """The same at every call."""
        infos = {agent: dict(info) for agent, info in self._infos.items()}
        return dict(self._observations), dict(self._rewards), dict(self._flags), dict(self._flags), infos


def rows(scale: Scale) -> list[Row]:
    """The environment, and a ceiling for anything that returns dictionaries; ``bench_peers.py`` has other people's."""
    ready, n_steps, target = Prebuilt(parallel_env()), scale.env_steps, 60_000
    taken = side_by_side(
        {"ours": stepping(parallel_env(), n_steps), "ceiling": stepping(ready, n_steps)}, scale.repetitions
    )
    ours, ceiling = n_steps / taken["ours"].cpu, n_steps / taken["ceiling"].cpu
    return [
        Row("`parallel_env()`, random actions", f"{ours:,.0f} steps/CPU-s", "", f"≥ {target:,}", ours >= target),
        Row("a loop that copies prebuilt dictionaries", f"{ceiling:,.0f} steps/CPU-s", f"ours {ours / ceiling:.2f} x"),
    ]


def random_actions(env: Any, n: int = 1000) -> list[dict[str, int]]:
    """Actions for all agents, drawn before the clock runs."""
    generator = np.random.default_rng(0)
    sizes = {agent: int(env.action_space(agent).n) for agent in env.possible_agents}
    return [{agent: int(generator.integers(n_actions)) for agent, n_actions in sizes.items()} for _ in range(n)]


def stepping(env: Any, n_steps: int) -> Callable[[], None]:
    """What plays so many steps; resets are part of the work."""
    env.reset(seed=0)
    ready = random_actions(env)

    def play() -> None:
        for number in range(n_steps):
            if not env.agents:
                env.reset()
            env.step(ready[number % len(ready)])

    return play
