"""Many worlds in which both teams are played from outside, beside loops, AgileRL's vectoriser and JaxMARL's tag.

A loop over ``parallel_env()``s and AgileRL's ``AsyncPettingZooVecEnv``, which steps each in a process of its own, do
the same work as ``parallel_vector_env``. Before anything is timed they are played side by side from the same seeds, and
must see and earn the same, through the end of an episode and into the next.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from bench.contenders import (
    MAX_CYCLES,
    Contender,
    LoopedEnvs,
    PeerScale,
    check_plays,
    check_same,
    find,
    rows_of,
    stepping_all,
)
from bench.jaxmarl import jaxmarl_contenders
from bench.page import Row
from predprey_env import EnvConfig, ParallelVectorEnv, parallel_env, parallel_vector_env

MANY, FEW = 1024, 16
"""Numbers of worlds beside JaxMARL, and beside processes."""
TARGET = 3_000_000
N_PREY = EnvConfig().n_prey


def rows(scale: PeerScale) -> list[Row]:
    """Return rows beside JaxMARL, and beside what steps one world after the other or each in a process."""
    many = _ours(MANY, scale, TARGET)
    beside_jax = rows_of([many, *jaxmarl_contenders(MANY, many.what)], scale.repetitions)
    few, vectoriser = _ours(FEW, scale), _vectoriser()
    others = {
        "a Python loop over `parallel_env()`s": LoopedEnvs([parallel_env() for _ in range(FEW)]),
        "AgileRL `AsyncPettingZooVecEnv`": vectoriser,
    }
    contenders, actions = [few], random_actions(parallel_vector_env(FEW))
    for what, env in others.items():
        if env is not None:
            check_same(what, env, parallel_vector_env(FEW), actions)
        run = env and stepping_all(env, actions, MAX_CYCLES)
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
    """Return AgileRL's vectoriser, or None where it is not installed or where the time of its processes is unknown.

    Its processes are not forked, as they would wait for ever once JAX has started threads.
    """
    vector = find("agilerl.vector") if sys.platform == "linux" else None
    return vector and vector.AsyncPettingZooVecEnv([parallel_env] * FEW, context="spawn")
