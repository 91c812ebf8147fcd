"""Why the moves' order decides the game, on the environment itself."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from esp_trainer.exact.solution import Solution, keys, solve
from predprey_env import predprey_v0
from predprey_env.config import EnvConfig

MOVES = np.array([(1, 0), (-1, 0), (0, 1), (0, -1), (0, 0)])


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
    config, values = in_turns.config, in_turns.values
    size = config.size
    joints = np.array(list(product(range(5), repeat=3)))
    env = predprey_v0.parallel_env(**config.model_dump())

    def after(offsets: np.ndarray, steps_left: int) -> tuple[float, int]:
        """The predators' best answer to where they are once the prey has moved: its value and number."""
        moved = (offsets + MOVES[joints]) % size
        caught = (moved == 0).all(axis=2).any(axis=1)
        number = in_turns.states.number[keys(moved[..., 0] * size + moved[..., 1], size)]
        worth = np.where(caught, 1.0, values[steps_left - 1, number])
        return float(worth.max()), int(worth.argmax())

    for seed in range(10):
        observations, _ = env.reset(seed=seed)
        for steps_left in range(config.max_cycles, 0, -1):
            offsets = observations["prey_0"].reshape(3, 2).astype(int)
            exits = [(offsets - MOVES[exit_]) % size for exit_ in range(4)]
            worst = [1.0 if (each == 0).all(axis=1).any() else after(each, steps_left)[0] for each in exits]
            observations, _, terminations, _, _ = env.step({"prey_0": int(np.argmin(worst))})
            if not env.agents:
                break
            offsets = -np.stack([observations[f"predator_{i}"] for i in range(3)]).astype(int)
            joint = joints[after(offsets, steps_left)[1]]
            actions = {f"predator_{i}": int(action) for i, action in enumerate(joint)}
            observations, _, terminations, _, _ = env.step(actions)
            if not env.agents:
                break
        assert terminations["prey_0"]
