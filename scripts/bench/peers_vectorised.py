"""Many team views made one vector environment in Python, beside the one that is compiled.

SuperSuit copies one environment for each world and steps them one after the other (``num_cpus`` 0 and 1 are the same,
in this process); a plain loop over the views that fills arrays is less still. Before anything is timed, each is played
side by side with ours from the same seeds, and must see and earn the same, through the end of an episode and into the
next.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from bench.contenders import MAX_CYCLES, Contender, LoopedEnvs, PeerScale, check_same, find, rows_of, stepping_all
from bench.page import Row
from bench.peers_batched import check_catches, make_env, random_actions
from bench.workload import random_team
from predprey_env import team_view
from predprey_env.config import TeamName
from predprey_env.policies.opponents import Opponent

N_WORLDS = 128
TEAM: TeamName = "predators"


class LoopedViews(LoopedEnvs):
    """A team view for each world, stepped in a loop; rows are agents, as in the vector environment."""

    def __init__(self, n_worlds: int, opponent: Opponent) -> None:
        super().__init__([team_view(TEAM, opponent) for _ in range(n_worlds)])
        self.action_space = self._envs[0].action_space(self._agents[0])
        self.num_envs = n_worlds * len(self._agents)

    def _by_world(self, actions: np.ndarray) -> Any:
        return actions.reshape(-1, len(self._agents)).tolist()

    def _together(self, worlds: Any) -> np.ndarray:
        return np.array([world[agent] for world in worlds for agent in self._agents])


def rows(scale: PeerScale) -> list[Row]:
    """Return rows against a script, and against random networks."""
    return [
        *_rows("run_straight", "prey that `run_straight`", scale),
        *_rows(random_team("prey"), "evolved prey (random networks)", scale),
    ]


def _rows(opponent: Opponent, who: str, scale: PeerScale) -> list[Row]:
    check_catches(TEAM, opponent)
    envs = {
        "`vector_env()`": make_env(N_WORLDS, TEAM, opponent),
        "SuperSuit `concat_vec_envs_v1` over `team_view()`s": _supersuit(opponent),
        "a Python loop over `team_view()`s": LoopedViews(N_WORLDS, opponent),
    }
    ours, *others = envs
    for what in others:
        if envs[what] is not None:
            check_same(what, envs[what], envs[ours], random_actions(envs[ours]))
    context = f", {N_WORLDS} worlds, {TEAM} against {who}"
    contenders = []
    for what, env in envs.items():
        n_calls = scale.n_calls(N_WORLDS) if what == ours else MAX_CYCLES
        run = stepping_all(env, random_actions(env), n_calls) if env is not None else None
        against = "" if what == ours else ours + context
        contenders.append(Contender(what + context, n_calls * N_WORLDS, run, against))
    return rows_of(contenders, scale.repetitions)


def _supersuit(opponent: Opponent) -> Any:
    supersuit = find("supersuit")
    if supersuit is None:
        return None
    one = supersuit.pettingzoo_env_to_vec_env_v1(team_view(TEAM, opponent))
    return supersuit.concat_vec_envs_v1(one, N_WORLDS, num_cpus=0, base_class="gymnasium")
