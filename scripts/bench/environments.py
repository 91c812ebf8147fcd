"""Steps per CPU-second through PettingZoo's parallel API, with random actions that were drawn before."""

from __future__ import annotations

import statistics
from typing import Any

import numpy as np
from mpe2 import simple_tag_v3

from bench.report import Row
from bench.timing import measure
from bench.workload import Scale
from predprey_env import EnvConfig, parallel_env

_SLOWER = 20  # times that simple_tag is given fewer steps to play


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
    """The environment, MPE's nearest relative, and a ceiling for anything that returns dictionaries."""
    cycles = EnvConfig().max_cycles
    tag = simple_tag_v3.parallel_env(num_adversaries=3, num_good=2, max_cycles=cycles)
    ours = steps_per_second(parallel_env(), scale.env_steps, scale.repetitions)
    theirs = steps_per_second(tag, max(1, scale.env_steps // _SLOWER), scale.repetitions)
    ceiling = steps_per_second(Prebuilt(parallel_env()), scale.env_steps, scale.repetitions)
    target = 60_000
    return [
        Row("`parallel_env()`, random actions", f"{ours:,.0f} steps/CPU-s", "", f"≥ {target:,}", ours >= target),
        Row(f"MPE `simple_tag`, 3 v 2, {cycles} cycles", f"{theirs:,.0f} steps/CPU-s", f"ours {ours / theirs:.0f} x"),
        Row("a loop that copies prebuilt dictionaries", f"{ceiling:,.0f} steps/CPU-s", f"ours {ours / ceiling:.2f} x"),
    ]


def steps_per_second(env: Any, n_steps: int, repetitions: int) -> float:
    """Median over the repetitions; resets are part of the time."""
    generator = np.random.default_rng(0)
    env.reset(seed=0)
    sizes = {agent: int(env.action_space(agent).n) for agent in env.possible_agents}
    ready = [{agent: int(generator.integers(n)) for agent, n in sizes.items()} for _ in range(1000)]

    def play() -> None:
        for number in range(n_steps):
            if not env.agents:
                env.reset()
            env.step(ready[number % len(ready)])

    play()
    return n_steps / statistics.median(measure(play).cpu for _ in range(repetitions))
