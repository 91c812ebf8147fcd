"""Environments that others compile, if installed: PufferLib's ``Target`` in C, JaxMARL's ``simple_tag`` in XLA.

Neither is the same game. ``Target``: agents with a heading and a speed run over goals that stand still until they are
reached, then jump elsewhere; nobody ends. JaxMARL's tag: circles with mass and contact forces, two obstacles, episodes
as long as ours. Agents' observations have 14 to 28 numbers there, 4 or 6 here.

JAX works on the CPU in 32-bit floats on one thread, as ``bench_peers.py`` asks of it before it is imported; whatever
threads it has besides are counted, as seconds are those of the process. What it compiles is compiled before the clock
runs, and each call waits for its results.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from bench.contenders import CYCLES, Contender, Scale, check_plays, find, stepping_all
from predprey_env import EnvConfig

N_PREDATORS, N_PREY = EnvConfig().n_predators, EnvConfig().n_prey
TARGETS = ((8, 4, "8 agents and 4 goals, its default"), (5, 2, "5 agents and 2 goals"), (3, 2, "3 agents and 2 goals"))
IN_A_SCAN = 30
"""Steps that XLA makes before Python hears of them, where it makes several."""


def pufferlib_contenders(n_worlds: int, against: str, scale: Scale) -> list[Contender]:
    """Target in its default sizes, and with as many agents and goals as ours has of both, or of each."""
    module, n_calls = find("pufferlib.ocean.target.target"), scale.n_calls(n_worlds)
    return [
        Contender(
            f"PufferLib `Target`, {n_worlds} worlds, {sizes}",
            n_agents,
            n_calls * n_worlds,
            module and _target(module, n_worlds, n_agents, n_goals, n_calls),
            against,
        )
        for n_agents, n_goals, sizes in TARGETS
    ]


def _target(module: Any, n_worlds: int, n_agents: int, n_goals: int, n_calls: int) -> Callable[[], None]:
    env = module.Target(num_envs=n_worlds, num_agents=n_agents, num_goals=n_goals)
    generator = np.random.default_rng(0)
    actions = [generator.integers(0, (9, 5), (env.num_agents, 2), np.int32) for _ in range(64)]
    env.reset(0)
    reached = sum(int((env.step(chosen)[1] > 0).sum()) for chosen in actions)
    check_plays("Target, which has no ends,", 1, reached)
    return stepping_all(env, actions, n_calls)


def jaxmarl_contenders(n_worlds: int, against: str) -> list[Contender]:
    """Tag stepped from Python as ours is, and many steps at a time."""
    jax, mpe = find("jax"), find("jaxmarl.environments.mpe")
    ways: tuple[Callable[[], object] | None, ...] = (None, None)
    if jax and mpe:
        tag = Tag(jax, mpe, n_worlds)
        ways = (tag.step_by_step, tag.scan)
    runs = zip(("a call for each step", f"`lax.scan` over {IN_A_SCAN} steps"), ways, strict=True)
    n_agents = N_PREDATORS + N_PREY
    return [
        Contender(f"JaxMARL `simple_tag`, {n_worlds} worlds, 3 v 2, {way}", n_agents, CYCLES * n_worlds, run, against)
        for way, run in runs
    ]


class Tag:
    """Many worlds of tag, compiled when this is made. A run, in either way, is as long as an episode."""

    def __init__(self, jax: Any, mpe: Any, n_worlds: int) -> None:
        self._wait = jax.block_until_ready
        # It ends in the step after max_steps.
        env = mpe.SimpleTagMPE(num_good_agents=N_PREY, num_adversaries=N_PREDATORS, max_steps=CYCLES - 1)
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
        """As ours is stepped: each call gives back what came of it."""
        for number in range(CYCLES):
            self._now, results = self._advance(self._now, self._actions[number % IN_A_SCAN])
            self._wait(results)

    def scan(self) -> list[Any]:
        """Many steps in one call, which gives back what came of each."""
        all_results = []
        for _ in range(CYCLES // IN_A_SCAN):
            self._now, results = self._scan(self._now)
            all_results.append(self._wait(results))
        return all_results


def _check_tag(results: Sequence[Any]) -> None:
    """See that every world ends, and that adversaries are rewarded for contact."""
    ended = sum(int(np.asarray(dones["__all__"]).sum()) for _, _, dones in results)
    touched = sum(int((np.asarray(rewards["adversary_0"]) > 0).sum()) for _, rewards, _ in results)
    check_plays("JaxMARL simple_tag", ended, touched)
