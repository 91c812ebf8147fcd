"""Many team views made one vector environment in Python, beside the one that is compiled.

SuperSuit copies one environment for each world and steps them one after the other (``num_cpus`` 0 and 1 are the same,
in this process); a plain loop over the views that fills arrays is less still. Before anything is timed, each is played
side by side with ours from the same seeds, and must see and earn the same, through the end of an episode and into the
next.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from bench.contenders import MAX_CYCLES, Contender, PeerScale, find, rows_of, stepping_all
from bench.page import Row
from bench.peers_batched import make_env, random_actions
from bench.workload import random_team
from predprey_env import team_view
from predprey_env.config import TeamName
from predprey_env.policies.opponents import Opponent

N_WORLDS = 128
TEAM: TeamName = "predators"


class LoopedViews:
    """A team view for each world, stepped in a loop: as little as it takes to fill arrays."""

    def __init__(self, n_worlds: int, opponent: Opponent) -> None:
        self._views = [team_view(TEAM, opponent) for _ in range(n_worlds)]
        self._agents = self._views[0].possible_agents
        self.action_space = self._views[0].action_space(self._agents[0])
        self.num_envs = n_worlds * len(self._agents)

    def reset(self, *, seed: int) -> tuple[np.ndarray, dict[str, Any]]:
        """Reset all worlds; world ``w`` is seeded with ``seed + w``."""
        seen = [view.reset(seed=seed + world)[0] for world, view in enumerate(self._views)]
        return np.array([views[agent] for views in seen for agent in self._agents]), {}

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, ...]:
        """Step all worlds, which start again in the step in which they end; rows are agents."""
        seen, earned, ended, late, agents = [], [], [], [], self._agents
        for view, chosen in zip(self._views, actions.reshape(-1, len(agents)).tolist(), strict=True):
            observations, rewards, terminated, truncated, _ = view.step(dict(zip(agents, chosen, strict=True)))
            if not view.agents:
                observations, _ = view.reset()
            seen += [observations[agent] for agent in agents]
            earned += [rewards[agent] for agent in agents]
            ended += [terminated[agent] for agent in agents]
            late += [truncated[agent] for agent in agents]
        return np.array(seen), np.array(earned), np.array(ended), np.array(late)


def rows(scale: PeerScale) -> list[Row]:
    """Return rows against a script, and against random networks."""
    return [
        *_rows("run_straight", "prey that `run_straight`", scale),
        *_rows(random_team("prey"), "evolved prey (random networks)", scale),
    ]


def _rows(opponent: Opponent, who: str, scale: PeerScale) -> list[Row]:
    envs = {
        "`vector_env()`": make_env(N_WORLDS, TEAM, opponent),
        "SuperSuit `concat_vec_envs_v1` over `team_view()`s": _supersuit(opponent),
        "a Python loop over `team_view()`s": LoopedViews(N_WORLDS, opponent),
    }
    ours, *others = envs
    for what in others:
        if envs[what] is not None:
            check_same(what, envs[what], envs[ours])
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


def check_same(what: str, other: Any, ours: Any) -> None:
    """Raise :class:`RuntimeError` unless another plays as ours does, from the same seeds, for more than an episode."""
    actions = random_actions(ours)
    same = np.array_equal(other.reset(seed=0)[0], ours.reset(seed=0)[0])
    n_ended = n_caught = 0
    for number in range(MAX_CYCLES + 20):
        chosen = actions[number % len(actions)]
        theirs, expected = other.step(chosen), ours.step(chosen)
        same = same and all(
            np.allclose(a, b, rtol=1e-6, atol=0.0) for a, b in zip(theirs[:4], expected[:4], strict=True)
        )
        ended = expected[2] | expected[3]
        n_ended += int(ended.sum())
        if ended.any():
            n_caught += int(expected[4]["final_info"]["n_captured"][ended].sum())
    if not same or not n_ended or not n_caught:
        raise RuntimeError(f"{what} must play as vector_env does: same {same}, {n_ended} ends, {n_caught} catches")
