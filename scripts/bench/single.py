"""One environment through PettingZoo's parallel API, by itself and beside its relatives there.

MPE's ``simple_tag`` moves circles with mass among two obstacles; its agents see 18 or 20 numbers, ours 4 or 6. SISL's
``pursuit`` is a grid of 16 x 16 with a wall in it, in which evaders move at random inside the environment and pursuers
surround them; each sees a window of 7 x 7 x 3. Its like is a view of our predators against random prey. Episodes are
equally long.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from bench.contenders import MAX_CYCLES, Contender, PeerScale, find, rows_of
from bench.page import Row
from bench.timing import side_by_side
from bench.workload import TrainerScale as OwnScale
from predprey_env import EnvConfig, parallel_env, team_view

PREDATORS, PREY = EnvConfig().n_predators, EnvConfig().n_prey


def own_rows(scale: OwnScale) -> list[Row]:
    """Return the row of the environment by itself."""
    n_steps, target = scale.env_steps, 60_000
    per_second = n_steps / side_by_side({"": stepping(parallel_env(), n_steps)}, scale.repetitions)[""].cpu
    figure = f"{per_second:,.0f} steps/CPU-s"
    return [Row("`parallel_env()`, random actions", figure, "", f"≥ {target:,}", per_second >= target)]


def rows(scale: PeerScale) -> list[Row]:
    """Return rows with both teams played from outside, then with one of them."""
    ours, view = "`parallel_env()`, 3 v 2", "`team_view()` of 3 predators, 2 random prey inside"
    tag, pursuit = find("mpe2.simple_tag_v3"), find("pettingzoo.sisl.pursuit_v5")
    tag = tag and tag.parallel_env(num_adversaries=PREDATORS, num_good=PREY, max_cycles=MAX_CYCLES)
    pursuit = pursuit and pursuit.parallel_env(n_pursuers=PREDATORS, n_evaders=PREY, max_cycles=MAX_CYCLES)
    n_steps = scale.n_episodes * MAX_CYCLES
    envs = {
        ours: (parallel_env(), ""),
        "MPE `simple_tag_v3`, 3 v 2": (tag, ours),
        view: (team_view("predators", "random"), ""),
        "SISL `pursuit_v5`, 3 pursuers, 2 random evaders inside": (pursuit, view),
    }
    contenders = [
        Contender(what, n_steps, env and stepping(env, n_steps), against) for what, (env, against) in envs.items()
    ]
    return rows_of(contenders, scale.repetitions)


def stepping(env: Any, n_steps: int) -> Callable[[], None]:
    """Return what plays so many steps, with actions drawn before; resets are part of the work.

    Raises :class:`RuntimeError` for an environment whose episodes do not end.
    """
    generator = np.random.default_rng(0)
    sizes = {agent: int(env.action_space(agent).n) for agent in env.possible_agents}
    ready = [{agent: int(generator.integers(n)) for agent, n in sizes.items()} for _ in range(1000)]

    def play() -> None:
        for number in range(n_steps):
            if not env.agents:
                env.reset()
            env.step(ready[number % len(ready)])

    env.reset(seed=0)
    for actions in ready[:MAX_CYCLES]:
        if env.agents:
            env.step(actions)
    if env.agents:
        raise RuntimeError(f"{env} must end an episode within {MAX_CYCLES} steps")
    return play
