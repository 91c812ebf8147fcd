"""One environment through PettingZoo's parallel API, beside its relatives there.

MPE's ``simple_tag`` moves circles with mass among two obstacles; its agents see 18 or 20 numbers, ours 4 or 6. SISL's
``pursuit`` is a grid of 16 x 16 with a wall in it, in which evaders move at random inside the environment and pursuers
surround them; each sees a window of 7 x 7 x 3. Its like is a view of our predators against random prey. Episodes are
equally long.
"""

from __future__ import annotations

from typing import Any

from bench.contenders import CYCLES, Contender, Scale, check_plays, find, rows_of
from bench.environments import random_actions, stepping
from bench.page import Row
from predprey_env import EnvConfig, parallel_env, team_view

N_PREDATORS, N_PREY = EnvConfig().n_predators, EnvConfig().n_prey
MOST_STEPS = 500 * CYCLES
"""In which even random predators must have caught one; it takes a tenth."""
PURSUITS = ("pettingzoo.sisl.pursuit_v5", "pettingzoo.sisl.pursuit_v4")
"""PettingZoo 1.27 has version 5, which adds a state; those before it have version 4."""


def rows(scale: Scale) -> list[Row]:
    """Both teams played from outside, then one of them."""
    ours, view = "`parallel_env()`, 3 v 2", "`team_view()` of 3 predators, 2 random prey inside"
    pursuit, version = _pursuit()
    return rows_of(
        [
            _contender(ours, parallel_env(), scale),
            _contender("MPE `simple_tag_v3`, 3 v 2", _simple_tag(), scale, ours),
            _contender(view, team_view("predators", "random"), scale),
            _contender(f"SISL `{version}`, 3 pursuers, 2 random evaders inside", pursuit, scale, view),
        ],
        scale.repetitions,
    )


def _contender(what: str, env: Any, scale: Scale, against: str = "") -> Contender:
    n_steps = scale.n_episodes * CYCLES
    if env is not None:
        _check(what, env)
    run = stepping(env, n_steps) if env is not None else None
    return Contender(what, N_PREDATORS + N_PREY, n_steps, run, against)


def _simple_tag() -> Any:
    module = find("mpe2.simple_tag_v3")
    return module and module.parallel_env(num_adversaries=N_PREDATORS, num_good=N_PREY, max_cycles=CYCLES)


def _pursuit() -> tuple[Any, str]:
    """The environment, and which version it is."""
    for path in PURSUITS:
        if (module := find(path)) is not None:
            env = module.parallel_env(n_pursuers=N_PREDATORS, n_evaders=N_PREY, max_cycles=CYCLES)
            return env, path.rpartition(".")[2]
    return None, "pursuit"


def _check(what: str, env: Any) -> None:
    """Play until an episode has ended and a predator got hold of somebody."""
    actions, n_ended, n_caught = random_actions(env), 0, 0
    env.reset(seed=0)
    for number in range(MOST_STEPS):
        if not env.agents:
            n_ended += 1
            env.reset()
        _, rewards, _, _, infos = env.step(actions[number % len(actions)])
        n_caught += _caught(rewards, infos)
        if n_ended and n_caught:
            break
    check_plays(what, n_ended, n_caught)


def _caught(rewards: dict[str, float], infos: dict[str, Any]) -> bool:
    """Whether a prey is caught; of a peer, whether a predator is rewarded for a touch.

    Pursuers pay 0.1 a step, and earn at least 0.001 by touching.
    """
    first = next(iter(rewards))
    if "n_captured" in infos[first]:
        return bool(infos[first]["n_captured"])
    return rewards[first] > (-0.0995 if first.startswith("pursuer") else 0.0)
