"""Whole hunts, and the fact of parity: on an even torus, where all move, who starts at an odd distance stays at one."""

from __future__ import annotations

import numpy as np
import pytest

from predprey_env import predprey_v0, team_view, vector_env
from predprey_env.policies import ScriptedTeam

N_WORLDS, N_STEPS = 100, 200


def starts(size: int, n_prey: int, *, odd: bool) -> np.ndarray:
    """Starts of three predators, all an odd way from the first prey, or all an even one; from a second the other."""
    cells = np.random.default_rng(2).integers(0, size, (100 * N_WORLDS, 3 + n_prey, 2))
    colours = cells.sum(axis=2) % 2  # of a chessboard
    good = (colours[:, :3] == (colours[:, 3:4] + odd) % 2).all(axis=1)
    if n_prey == 2:
        good &= colours[:, 3] != colours[:, 4]
    good &= (cells[:, :3, None] != cells[:, None, 3:]).any(axis=3).all(axis=(1, 2))  # nobody starts on a prey
    return cells[good][:N_WORLDS]


def caught(script: str, size: int = 10, n_prey: int = 1, *, odd: bool = True, **rules: object) -> np.ndarray:
    """Which prey, walking at random, are caught in the first episode of each world: bool ``(n_worlds, n_prey)``."""
    env = vector_env(N_WORLDS, "prey", script, "SameStep", size=size, n_prey=n_prey, max_cycles=N_STEPS, **rules)
    env.reset(seed=0, options={"starts": starts(size, n_prey, odd=odd)})
    actions, found = np.random.default_rng(0), np.zeros(env.num_envs, bool)
    playing = ~found
    for _ in range(N_STEPS):
        _, _, terminated, truncated, infos = env.step(actions.integers(0, 4, env.num_envs))
        found |= playing & (terminated | (infos["captured"] == 1))
        playing &= ~(terminated | truncated)
    assert not playing.any()
    return found.reshape(N_WORLDS, n_prey)


def test_greedy_chasers_never_catch_a_prey_from_which_all_start_at_an_odd_distance() -> None:
    assert not caught("greedy_chase", odd=True).any()
    assert caught("greedy_chase", odd=False).mean() > 0.9


@pytest.mark.parametrize("odd", [True, False])
def test_of_two_prey_they_catch_the_one_at_an_even_distance(odd: bool) -> None:
    even, other = caught("greedy_chase", n_prey=2, odd=odd).T[:: -1 if odd else 1]
    assert even.mean() > 0.9
    assert not other.any()


@pytest.mark.parametrize("script", ["parity_chase", "intercept", "surround"])
@pytest.mark.parametrize("odd", [True, False])
def test_who_idles_in_time_catches_them_all(script: str, odd: bool) -> None:
    assert caught(script, odd=odd).all()


@pytest.mark.parametrize("script", ["parity_chase", "intercept", "surround"])
def test_where_nobody_may_idle_parity_cannot_be_mended(script: str) -> None:
    assert not caught(script, odd=True, predator_idle=False).any()


@pytest.mark.parametrize("script", ["parity_chase", "intercept", "surround"])
@pytest.mark.parametrize("odd", [True, False])
def test_in_turns_they_idle_in_time_as_well(script: str, odd: bool) -> None:
    assert caught(script, odd=odd, move_order="prey_first").all()


def test_on_an_odd_torus_the_way_round_mends_it() -> None:
    assert caught("greedy_chase", size=9, odd=True).mean() > 0.5


@pytest.mark.parametrize("script", ["greedy_chase", "parity_chase"])
@pytest.mark.parametrize("prey", ["run_straight", "flee_nearest"])
def test_who_only_follows_never_gets_a_prey_that_runs_away(script: str, prey: str) -> None:
    env = predprey_v0.parallel_env(n_predators=1, n_prey=1, size=20)
    views, _ = env.reset(options={"starts": [[0, 0], [4, 0]]})
    hunter, runner = ScriptedTeam(script), ScriptedTeam(prey)
    for _ in range(60):
        assert views["predator_0"].tolist() == [4, 0]
        views, *_ = env.step(hunter.act(views) | runner.act(views))


@pytest.mark.parametrize("script", ["greedy_chase", "parity_chase", "intercept", "surround"])
def test_in_turns_a_predator_takes_the_prey_beside_it(script: str) -> None:
    """The prey goes to (1, 0), the predator at (0, 0) sees it there."""
    view = team_view("prey", script, n_predators=1, n_prey=1, size=20, move_order="prey_first")
    view.reset(seed=0, options={"starts": [[0, 0], [2, 0]]})
    *_, infos = view.step({"prey_0": 1})
    assert infos["prey_0"]["captured"] == 1
