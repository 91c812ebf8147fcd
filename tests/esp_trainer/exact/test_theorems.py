"""Why the moves' order decides the game, on the environment itself."""

from __future__ import annotations

from itertools import cycle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from esp_trainer.exact.solution import Solution, solve
from esp_trainer.exact.team import OptimalTeam
from predprey_env import predprey_v0
from predprey_env.config import EnvConfig


@given(st.integers(3, 9), st.integers(0, 2**32 - 1))
def test_a_prey_that_foresees_three_predators_always_has_a_free_exit(size: int, seed: int) -> None:
    """It has four, and the predators are in three cells after their moves."""
    rng = np.random.default_rng(seed)
    env = predprey_v0.parallel_env(size=size, n_prey=1)
    starts = np.vstack([rng.integers(size, size=(3, 2)), rng.integers(size, size=(1, 2))])
    if (starts[:3] == starts[3]).all(axis=1).any():
        return
    foreseen = {f"predator_{i}": int(rng.integers(5)) for i in range(3)}
    free = []
    for exit_ in range(4):
        env.reset(seed=0, options={"starts": starts})
        _, _, terminations, _, _ = env.step({**foreseen, "prey_0": exit_})
        free.append(not terminations["prey_0"])
    assert any(free)


@pytest.fixture(scope="module", params=[4, 5, 6])
def in_turns(request: pytest.FixtureRequest) -> Solution:
    size = int(request.param)
    return solve(EnvConfig(size=size, n_prey=1, move_order="prey_first", max_cycles=3 * size), 3 * size)


def test_moving_in_turns_three_predators_win_from_everywhere(in_turns: Solution) -> None:
    assert in_turns.values[-1].min() == 1.0


def test_moving_in_turns_three_predators_catch_the_best_of_prey_in_the_environment(in_turns: Solution) -> None:
    env = predprey_v0.parallel_env(**in_turns.config.model_dump())
    predators, prey = OptimalTeam("predators", in_turns), OptimalTeam("prey", in_turns)
    for seed in range(10):
        observations, _ = env.reset(seed=seed)
        predators.reset(seed)
        prey.reset(seed)
        terminations: dict[str, bool] = {}
        for team in cycle((prey, predators)):
            observations, _, terminations, _, _ = env.step(team.act(observations))
            if not env.agents:
                break
        assert terminations["prey_0"]
