"""Many worlds at once: the vector environment by size and by opponent, beside one that others compile."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from bench.contenders import MAX_CYCLES, Contender, PeerScale, check_plays, rows_of, stepping_all
from bench.jaxmarl import jaxmarl_contenders
from bench.page import Row
from bench.workload import random_team
from predprey_env import PredPreyVectorEnv, vector_env
from predprey_env.config import TeamName
from predprey_env.policies.opponents import Opponent

SIZES = (1, 16, 128, 1024, 4096)
N_WORLDS = 1024
"""Number of worlds at which all are compared, and to which the target applies."""
TARGET = 3_000_000


def rows(scale: PeerScale) -> list[Row]:
    """Return rows of the vector environment and of its compiled peers."""
    contenders = [_ours(size, "predators", "random", "random prey", scale) for size in SIZES]
    base = contenders[SIZES.index(N_WORLDS)].what
    contenders += [
        _ours(N_WORLDS, "predators", "run_straight", "prey that `run_straight`", scale),
        _ours(N_WORLDS, "predators", random_team("prey"), "evolved prey (random networks)", scale),
        _ours(N_WORLDS, "prey", "parity_chase", "predators that `parity_chase`", scale),
        _ours(N_WORLDS, "prey", random_team("predators"), "evolved predators (random networks)", scale),
    ]
    return rows_of([*contenders, *jaxmarl_contenders(N_WORLDS, base)], scale.repetitions)


def make_env(n_worlds: int, team: TeamName, opponent: Opponent) -> PredPreyVectorEnv:
    """Make worlds that start again in the step in which they end: every call is a time step of every world."""
    return vector_env(n_worlds, team, opponent, AutoresetMode.SAME_STEP)


def random_actions(env: Any, n: int = 64) -> list[np.ndarray]:
    """Return actions for all rows, drawn before the clock runs."""
    generator = np.random.default_rng(0)
    n_actions = int(getattr(env, "single_action_space", env.action_space).n)
    return [generator.integers(0, n_actions, env.num_envs) for _ in range(n)]


def _ours(n_worlds: int, team: TeamName, opponent: Opponent, who: str, scale: PeerScale) -> Contender:
    check_catches(team, opponent)
    target = TARGET if (n_worlds, opponent) == (N_WORLDS, "random") else None
    env, n_calls = make_env(n_worlds, team, opponent), scale.n_calls(n_worlds)
    env.reset(seed=0)
    what = f"`vector_env({n_worlds}, ...)`, {team} against {who}"
    run = stepping_all(env, random_actions(env), n_calls)
    return Contender(what, n_calls * n_worlds, run, target=target)


def check_catches(team: TeamName, opponent: Opponent) -> None:
    """See that every world ends, and that prey are caught."""
    env, n_ended, n_caught = make_env(N_WORLDS, team, opponent), 0, 0
    env.reset(seed=0)
    actions = random_actions(env)
    for number in range(MAX_CYCLES):
        _, _, terminated, truncated, infos = env.step(actions[number % len(actions)])
        ended = terminated | truncated
        if ended.any():
            n_ended += int(ended.sum())
            n_caught += int(infos["final_info"]["n_captured"][ended].sum())
    check_plays(f"vector_env of {team} against {opponent}", n_ended // (env.num_envs // N_WORLDS), n_caught)
