"""The solved game beside the environment itself, and the values of small tori."""

from __future__ import annotations

from functools import cache
from itertools import permutations, product
from typing import TypeAlias

import numpy as np
import pytest
from scipy.optimize import linprog

from esp_trainer.exact.solution import by_parity, memory_needed, solve
from esp_trainer.exact.states import moves_of, states_of, symmetries
from predprey_env import predprey_v0
from predprey_env.config import EnvConfig

Cells: TypeAlias = tuple[int, ...]

WORLDS = {
    "simultaneous": {},
    "predators may not idle": {"predator_idle": False},
    "prey first": {"move_order": "prey_first"},
    "swaps capture": {"swap_captures": True},
}
each_world = pytest.mark.parametrize("fields", WORLDS.values(), ids=WORLDS)


@pytest.mark.parametrize(("size", "n_predators"), [(3, 1), (4, 2), (3, 3)])
def test_states_that_look_alike_have_one_number_and_others_have_others(size: int, n_predators: int) -> None:
    states, n_cells = states_of(size, n_predators), size * size

    def alike(cells: tuple[int, ...]) -> frozenset[tuple[int, ...]]:
        images = [tuple(int(turned[cell]) for cell in cells) for turned in symmetries(size)]
        return frozenset(order for image in images for order in permutations(image))

    numbers: dict[frozenset[tuple[int, ...]], int] = {}
    for place, cells in enumerate(product(range(n_cells), repeat=n_predators)):
        if 0 in cells:
            assert states.number[place] == -1
        else:
            assert numbers.setdefault(alike(cells), states.number[place]) == states.number[place]
    assert sorted(numbers.values()) == list(range(len(states.cells)))


@cache
def played(
    config: EnvConfig, cells: tuple[int, ...], joint: tuple[int, ...], prey_action: int
) -> tuple[int, ...] | None:
    """The predators' cells after a step of the environment; None if the prey is caught."""
    env, size = predprey_v0.parallel_env(**config.model_dump()), config.size
    env.reset(seed=0, options={"starts": np.array([*(divmod(cell, size) for cell in cells), (0, 0)])})
    actions = {f"predator_{i}": action for i, action in enumerate(joint)} | {"prey_0": prey_action}
    for _ in range(2 if config.move_order == "prey_first" else 1):
        _, _, terminations, _, _ = env.step(actions)
        if all(terminations.values()):
            return None
    n_agents = config.n_agents
    x, y = (env.state()[axis * n_agents :][:n_agents].astype(int) for axis in (0, 1))
    return tuple(int(cell) for cell in (x[:-1] - x[-1]) % size * size + (y[:-1] - y[-1]) % size)


@each_world
def test_a_predators_moves_are_those_of_the_environment(fields: dict[str, object]) -> None:
    config = EnvConfig(size=5, n_predators=1, n_prey=1, **fields)  # type: ignore[arg-type]
    moves = moves_of(config)
    for cell, action, prey_action in product(range(1, 25), range(config.n_predator_actions), range(4)):
        after = played(config, (cell,), (action,), prey_action)
        assert moves.caught[cell, action, prey_action] == (after is None)
        if after is not None:
            assert moves.cell[cell, action, prey_action] == after[0]


@each_world
def test_values_are_those_of_a_plain_recursion_over_the_environment(fields: dict[str, object]) -> None:
    config, horizon = EnvConfig(size=3, n_predators=2, n_prey=1, **fields), 3  # type: ignore[arg-type]
    joints = list(product(range(config.n_predator_actions), repeat=2))

    @cache
    def value(cells: tuple[int, ...], steps: int) -> float:
        if steps == 0:
            return 0.0
        after = [[played(config, cells, joint, b) for b in range(4)] for joint in joints]
        payoffs = np.array([[1.0 if each is None else value(each, steps - 1) for each in row] for row in after])
        if config.move_order == "prey_first":
            return float(payoffs.max(axis=0).min())
        return value_by_scipy(payoffs)

    solution = solve(config, horizon)
    for cells in product(range(1, 9), repeat=2):
        for steps in range(horizon + 1):
            assert solution.value(np.array(cells), steps) == pytest.approx(value(cells, steps), abs=1e-9)


def value_by_scipy(payoffs: np.ndarray) -> float:
    """Of the game in which the prey's mixture must hold the predators' best below as little as it can."""
    m, n = payoffs.shape
    sums, at_most = [[*np.ones(n), 0.0]], np.c_[payoffs, -np.ones(m)]
    return float(linprog([*np.zeros(n), 1.0], at_most, np.zeros(m), sums, [1.0], [(0, None)] * (n + 1)).fun)


@pytest.mark.parametrize(
    ("size", "steps", "fields", "mean", "parities"),
    [
        (6, 5, {}, 0.798, [0.704, 0.777, 0.830, 0.872]),
        (6, 10, {}, 0.994, [0.991, 0.993, 0.995, 0.996]),
        (6, 20, {"predator_idle": False}, 0.123, [0, 0, 0.023, 1]),
        (6, 5, {"move_order": "prey_first"}, 1.000, [0.997, 1, 1, 1]),
        (8, 10, {}, 0.853, [0.823, 0.844, 0.863, 0.881]),
        (10, 15, {}, 0.841, [0.821, 0.835, 0.848, 0.860]),
    ],
)
def test_values_of_three_predators_on_small_tori(
    size: int, steps: int, fields: dict[str, object], mean: float, parities: list[float]
) -> None:
    """By all starts, and by how many predators start at an even distance; another program found the same."""
    solution = solve(EnvConfig(size=size, n_prey=1, **fields), steps)  # type: ignore[arg-type]
    found = by_parity(solution, steps)
    assert found[0] == pytest.approx(mean, abs=5e-4)
    assert found[1] == pytest.approx(parities, abs=5e-4)


def test_more_time_never_hurts_the_predators() -> None:
    values = solve(EnvConfig(size=6, n_prey=1), 12).values
    assert (values[0] == 0).all()
    assert (np.diff(values, axis=0) >= -1e-12).all()
    assert values[-1].max() <= 1 + 1e-12


def test_threads_change_nothing() -> None:
    one, two = (solve(EnvConfig(size=6, n_prey=1), 4, threads=threads).values for threads in (1, 2))
    assert one.tobytes() == two.tobytes()


def test_memory_is_known_before_it_is_taken() -> None:
    config = EnvConfig(size=8, n_prey=1)
    solution = solve(config, 10)
    taken = sum(array.nbytes for array in (*solution.states, solution.values))
    assert taken <= memory_needed(config, 10) <= 2 * taken


def test_a_game_with_two_prey_is_refused() -> None:
    with pytest.raises(ValueError, match="only games with one prey can be solved, got 2"):
        solve(EnvConfig(size=5), 3)
