"""JaxMARL's ``simple_tag``, compiled by XLA, if it is installed.

It is another game: circles with mass and contact forces, two obstacles, episodes as long as ours. Agents see 16 or more
numbers there, 4 or 6 here.

JAX works on the CPU in 32-bit floats on one thread, as ``bench_peers.py`` asks of it before it is imported; whatever
threads it has besides are counted, as seconds are those of the process. What it compiles is compiled before the clock
runs, and each call waits for its results.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from bench.contenders import MAX_CYCLES, Contender, check_plays, find
from predprey_env import EnvConfig

N_PREDATORS, N_PREY = EnvConfig().n_predators, EnvConfig().n_prey
IN_A_SCAN = 30
"""Steps that XLA makes before Python hears of them, where it makes several."""


def jaxmarl_contenders(n_worlds: int, against: str) -> list[Contender]:
    """Return tag stepped from Python as ours is, and many steps at a time."""
    jax, mpe = find("jax"), find("jaxmarl.environments.mpe")
    ways: tuple[Callable[[], object] | None, ...] = (None, None)
    if jax and mpe:
        tag = Tag(jax, mpe, n_worlds)
        ways = (tag.step_by_step, tag.scan)
    runs = zip(("a call for each step", f"`lax.scan` over {IN_A_SCAN} steps"), ways, strict=True)
    return [
        Contender(f"JaxMARL `simple_tag`, {n_worlds} worlds, 3 v 2, {way}", MAX_CYCLES * n_worlds, run, against)
        for way, run in runs
    ]


class Tag:
    """Many worlds of tag, compiled when this is made. A run, in either way, is as long as an episode."""

    def __init__(self, jax: Any, mpe: Any, n_worlds: int) -> None:
        self._wait = jax.block_until_ready
        # It ends in the step after max_steps.
        env = mpe.SimpleTagMPE(num_good_agents=N_PREY, num_adversaries=N_PREDATORS, max_steps=MAX_CYCLES - 1)
        generator = np.random.default_rng(0)
        drawn = {agent: generator.integers(0, 5, (IN_A_SCAN, n_worlds), np.int32) for agent in env.agents}
        actions = {agent: jax.numpy.asarray(rows) for agent, rows in drawn.items()}
        self._actions = [{agent: rows[i] for agent, rows in actions.items()} for i in range(IN_A_SCAN)]

        def advance(now: Any, chosen: Any) -> Any:
            key, state = now
            key, used = jax.random.split(key)
            seen, state, rewards, dones, _ = jax.vmap(env.step)(jax.random.split(used, n_worlds), state, chosen)
            return (key, state), (seen, rewards, dones)

        self._advance, self._scan = jax.jit(advance), jax.jit(lambda now: jax.lax.scan(advance, now, actions))
        key = jax.random.PRNGKey(0)
        _, state = jax.jit(jax.vmap(env.reset))(jax.random.split(key, n_worlds))
        self._now = (key, state)
        self.step_by_step()
        _check_tag(self.scan())

    def step_by_step(self) -> None:
        """Step as ours is stepped: each call gives back what came of it."""
        for number in range(MAX_CYCLES):
            self._now, results = self._advance(self._now, self._actions[number % IN_A_SCAN])
            self._wait(results)

    def scan(self) -> list[Any]:
        """Make many steps in one call, which gives back what came of each."""
        all_results = []
        for _ in range(MAX_CYCLES // IN_A_SCAN):
            self._now, results = self._scan(self._now)
            all_results.append(self._wait(results))
        return all_results


def _check_tag(results: Sequence[Any]) -> None:
    """See that every world ends, and that adversaries are rewarded for contact."""
    ended = sum(int(np.asarray(dones["__all__"]).sum()) for _, _, dones in results)
    touched = sum(int((np.asarray(rewards["adversary_0"]) > 0).sum()) for _, rewards, _ in results)
    check_plays("JaxMARL simple_tag", ended, touched)
