"""Many worlds in which both teams are played from outside, beside loops, AgileRL's vectoriser and JaxMARL's tag.

A loop over ``parallel_env()``s and AgileRL's ``AsyncPettingZooVecEnv``, which steps each in a process of its own, do
the same work as ``parallel_vector_env``. Before anything is timed they are played side by side from the same seeds, and
must see and earn the same, through the end of an episode and into the next.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Any

import numpy as np

from bench.contenders import MAX_CYCLES, Contender, PeerScale, check_plays, find, rows_of, stepping_all
from bench.jaxmarl import jaxmarl_contenders
from bench.page import Row
from predprey_env import EnvConfig, ParallelVectorEnv, parallel_env, parallel_vector_env

MANY, FEW = 1024, 16
"""Numbers of worlds beside JaxMARL, and beside processes."""
TARGET = 3_000_000
N_PREY = EnvConfig().n_prey


class LoopedEnvs:
    """A parallel environment for each world, stepped in a loop: as little as it takes to fill arrays."""

    def __init__(self, n_worlds: int) -> None:
        self._envs = [parallel_env() for _ in range(n_worlds)]
        self._agents = self._envs[0].possible_agents

    def reset(self, seed: int) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Start world ``w`` from the seed ``seed + w``."""
        return self._together([env.reset(seed=seed + world)[0] for world, env in enumerate(self._envs)]), {}

    def step(self, actions: Mapping[str, np.ndarray]) -> tuple[dict[str, np.ndarray], ...]:
        """Step all worlds, which start again in the step in which they end."""
        told = []
        chosen = zip(*(actions[agent].tolist() for agent in self._agents), strict=True)
        for env, row in zip(self._envs, chosen, strict=True):
            observations, *results, _ = env.step(dict(zip(self._agents, row, strict=True)))
            if not env.agents:
                observations, _ = env.reset()
            told.append((observations, *results))
        return tuple(self._together(each) for each in zip(*told, strict=True))

    def _together(self, worlds: Any) -> dict[str, np.ndarray]:
        return {agent: np.array([world[agent] for world in worlds]) for agent in self._agents}


def rows(scale: PeerScale) -> list[Row]:
    """Return rows beside JaxMARL, and beside what steps one world after the other or each in a process."""
    many = _ours(MANY, scale, TARGET)
    beside_jax = rows_of([many, *jaxmarl_contenders(MANY, many.what)], scale.repetitions)
    few, vectoriser = _ours(FEW, scale), _vectoriser()
    others = {"a Python loop over `parallel_env()`s": LoopedEnvs(FEW), "AgileRL `AsyncPettingZooVecEnv`": vectoriser}
    contenders = [few]
    for what, env in others.items():
        if env is not None:
            check_same(what, env)
        run = env and stepping_all(env, random_actions(parallel_vector_env(FEW)), MAX_CYCLES)
        contenders.append(Contender(f"{what}, {FEW} worlds, both teams from outside", MAX_CYCLES * FEW, run, few.what))
    found = rows_of(contenders, scale.repetitions)
    if vectoriser is not None:
        vectoriser.close()
    return [*beside_jax, *found]


def random_actions(env: ParallelVectorEnv, n: int = 64) -> list[dict[str, np.ndarray]]:
    """Return actions for all agents in all worlds, drawn before the clock runs."""
    generator = np.random.default_rng(0)
    sizes = {agent: env.single_action_space(agent).n for agent in env.possible_agents}
    return [{agent: generator.integers(0, size, env.n_worlds) for agent, size in sizes.items()} for _ in range(n)]


def _ours(n_worlds: int, scale: PeerScale, target: int | None = None) -> Contender:
    env, n_calls = parallel_vector_env(n_worlds), scale.n_calls(n_worlds)
    env.reset(seed=0)
    actions, n_ended, n_caught = random_actions(env), 0, 0
    for number in range(MAX_CYCLES):
        _, _, terminated, truncated, _ = env.step(actions[number % len(actions)])
        ended = terminated["prey_0"] | truncated["prey_0"]
        n_ended += int(ended.sum())
        n_caught += int((env.final_state[ended, -1 - N_PREY : -1] == 0).sum())
    if target:
        check_plays("parallel_vector_env", n_ended // n_worlds, n_caught)
    what = f"`parallel_vector_env({n_worlds})`, both teams from outside"
    return Contender(what, n_calls * n_worlds, stepping_all(env, actions, n_calls), target=target)


def _vectoriser() -> Any:
    """Return AgileRL's vectoriser, or None where it is not installed or where the time of its processes is unknown."""
    vector = find("agilerl.vector") if sys.platform == "linux" else None
    return vector and vector.AsyncPettingZooVecEnv([parallel_env] * FEW)


def check_same(what: str, other: Any) -> None:
    """Raise :class:`RuntimeError` unless another plays as ours does, from the same seeds, for more than an episode."""
    ours = parallel_vector_env(FEW)
    actions = random_actions(ours)
    same, n_ended = _same(other.reset(seed=0)[0], ours.reset(seed=0)[0]), 0
    for number in range(MAX_CYCLES + 20):
        theirs, expected = other.step(actions[number % len(actions)]), ours.step(actions[number % len(actions)])
        same = same and all(_same(a, b) for a, b in zip(theirs[:4], expected[:4], strict=True))
        n_ended += int((expected[2]["prey_0"] | expected[3]["prey_0"]).sum())
    if not same or not n_ended:
        raise RuntimeError(f"{what} must play as parallel_vector_env does: same {same}, {n_ended} ends")


def _same(theirs: Mapping[str, np.ndarray], ours: Mapping[str, np.ndarray]) -> bool:
    return all(np.allclose(theirs[agent], ours[agent], rtol=1e-6, atol=0.0) for agent in ours)
