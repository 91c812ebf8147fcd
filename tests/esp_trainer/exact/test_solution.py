"""The solved game beside the environment itself, and the values of small tori."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pytest
from scipy.optimize import linprog

from esp_trainer.exact.parity import by_parity, means_by_parity
from esp_trainer.exact.solution import Solution, memory_needed, solve
from esp_trainer.exact.states import n_keys, states_of, turns_of
from esp_trainer.files import DamagedFileError
from predprey_env import PredPreyEnv
from predprey_env.config import EnvConfig
from predprey_env.settings import PartError

Cells: TypeAlias = tuple[int, ...]

WORLDS: dict[str, dict[str, Any]] = {
    "simultaneous": {},
    "predators may not idle": {"predator_idle": False},
    "prey first": {"move_order": "prey_first"},
    "swaps capture": {"swap_captures": True},
}
each_world = pytest.mark.parametrize("fields", WORLDS.values(), ids=WORLDS)


@pytest.mark.parametrize(
    ("size", "n_predators", "n_prey"), [(3, 1, 1), (4, 2, 1), (3, 3, 1), (4, 1, 2), (3, 2, 2), (3, 1, 3)]
)
def test_states_that_look_alike_have_one_number_and_others_have_others(
    size: int, n_predators: int, n_prey: int
) -> None:
    states = states_of(size, n_predators, n_prey)
    begin = 0
    for left in range(1, n_prey + 1):
        numbers: dict[object, int] = {}
        for key, digits in enumerate(product(range(size * size), repeat=n_predators + left - 1), begin):
            predators, prey = digits[:n_predators], (0, *digits[n_predators:])
            if set(predators) & set(prey):
                assert states.number[key] == -1
            else:
                assert numbers.setdefault(alike(predators, prey, size), states.number[key]) == states.number[key]
        begin += n_keys(size, n_predators, left)
        assert sorted(numbers.values()) == list(range(states.first[left - 1], states.first[left]))
    assert begin == len(states.number)


def alike(predators: Cells, prey: Cells, size: int) -> object:
    """What all states that come to the same have in common: they as they look from anywhere, any way."""
    turns: list[Callable[[int, int], tuple[int, int]]] = [
        lambda x, y, a=a, b=b, swap=swap: (a * y, b * x) if swap else (a * x, b * y)  # type: ignore[misc]
        for a, b, swap in product((1, -1), (1, -1), (False, True))
    ]
    looks = []
    for turn in turns:
        for east, north in product(range(size), repeat=2):
            teams = []
            for team in (predators, prey):
                turned = [turn(*divmod(cell, size)) for cell in team]
                teams.append(tuple(sorted(((x + east) % size, (y + north) % size) for x, y in turned)))
            looks.append(tuple(teams))
    return min(looks)


def test_the_states_that_stand_for_others_are_among_them() -> None:
    states = states_of(3, 2, 2)
    for number, cells in enumerate(states.cells.tolist()):
        free = [cell for cell in cells[2:] if cell >= 0]
        digits, game = (*cells[:2], *free[1:]), len(free) - 1
        assert states.number[states.first_key[game] + int(np.ravel_multi_index(digits, (9,) * len(digits)))] == number
        assert cells[2] == 0


@cache
def world_of(config: EnvConfig) -> PredPreyEnv:
    """One environment for all steps that are played in it."""
    return PredPreyEnv(config)


@cache
def played(config: EnvConfig, predators: Cells, prey: Cells, joint: Cells, flights: Cells) -> tuple[Cells, Cells]:
    """The predators' cells after a step of the environment, and those of the prey that are free."""
    env, size = world_of(config), config.size
    env.reset(options={"starts": np.array([divmod(cell, size) for cell in (*predators, *prey)])})
    actions = {f"predator_{i}": action for i, action in enumerate(joint)}
    actions |= {f"prey_{i}": action for i, action in enumerate(flights)}
    for _ in range(2 if config.move_order == "prey_first" else 1):
        if env.agents:
            env.step(actions)
    n, state = config.n_agents, env.state().astype(int)
    cells, alive = state[:n] * size + state[n : 2 * n], state[2 * n : -1]
    free = tuple(cells[config.n_predators :][alive == 1].tolist())
    return tuple(cells[: config.n_predators].tolist()), free


@each_world
@pytest.mark.parametrize(
    ("n_predators", "n_prey", "horizon"),
    [(2, 1, 2), (1, 2, 1), *(pytest.param(*each, marks=pytest.mark.slow) for each in [(1, 2, 3), (2, 2, 1)])],
)
def test_values_are_those_of_a_plain_recursion_over_the_environment(
    fields: dict[str, Any], n_predators: int, n_prey: int, horizon: int
) -> None:
    config = EnvConfig(size=3, n_predators=n_predators, n_prey=n_prey, **fields)
    joints = list(product(range(config.n_predator_actions), repeat=n_predators))

    @cache
    def value(predators: Cells, prey: Cells, steps: int) -> float:
        """How many prey are caught; where they are on the torus makes no difference, so the first is in cell 0."""
        if steps == 0 or not prey:
            return 0.0
        flights = list(product(range(4), repeat=len(prey)))
        world = config.replace(n_prey=len(prey))
        payoffs = np.zeros((len(joints), len(flights)))
        for (i, joint), (j, flight) in product(enumerate(joints), enumerate(flights)):
            hunters, free = played(world, predators, prey, joint, flight)
            seen = [moved(cells, free[0], 3) if free else () for cells in (hunters, free)]
            payoffs[i, j] = len(prey) - len(free) + value(seen[0], seen[1], steps - 1)
        if config.move_order == "prey_first":
            return float(payoffs.max(axis=0).min())
        return value_by_scipy(payoffs)

    solution, starts = solve(config, horizon), list(product(range(9), repeat=config.n_agents - 1))
    for start in starts[:: len(starts) // 6]:
        predators, prey = start[:n_predators], (0, *start[n_predators:])
        if not set(predators) & set(prey):
            for steps in range(horizon + 1):
                found = solution.value(np.array((*predators, *prey)), steps)
                assert found == pytest.approx(value(predators, prey, steps), abs=1e-9)


def moved(cells: Cells, origin: int, size: int) -> Cells:
    """Cells on a torus that is moved until one is the first."""
    x, y = (np.array(cells) // size - origin // size) % size, (np.array(cells) - origin % size) % size
    return tuple((x * size + y).tolist())


def test_where_the_agents_are_on_the_torus_makes_no_difference() -> None:
    solution = solve(EnvConfig(size=4), 4)
    cells = (1, 5, 14, 0, 8)
    assert solution.value(np.array(cells), 4) == solution.value(np.array(moved(cells, 7, 4)), 4) > 0.5
    assert solution.value(np.array([cells, (14, 1, 5, 8, 0)]), 4).tolist() == [solution.value(np.array(cells), 4)] * 2


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
        pytest.param(10, 15, {}, 0.841, [0.821, 0.835, 0.848, 0.860], marks=pytest.mark.slow),
    ],
)
def test_values_of_three_predators_on_small_tori(
    size: int, steps: int, fields: dict[str, Any], mean: float, parities: list[float]
) -> None:
    """By all starts, and by how many predators start at an even distance; another program found the same."""
    solution = solve(EnvConfig(size=size, n_prey=1, **fields), steps)
    found = by_parity(solution, steps)
    assert found[0] == pytest.approx(mean, abs=5e-4)
    assert found[1] == pytest.approx(parities, abs=5e-4)


@pytest.mark.parametrize("n_prey", [1, 2])
def test_means_are_the_same_over_what_looks_alike_and_over_all(n_prey: int) -> None:
    config = EnvConfig(size=4, n_predators=2, n_prey=n_prey)
    solution = solve(config, 4)
    places = np.array([(*start[:2], 0, *start[2:]) for start in product(range(16), repeat=1 + n_prey)])
    free = ~(places[:, :2, None] == places[:, None, 2:]).any(axis=(1, 2))
    values = np.full(len(places), np.nan)  # which are not to be seen
    values[free] = solution.value(places[free], 4)
    mean, by_even = means_by_parity(values, solution)
    assert (mean, by_even) == tuple(pytest.approx(each, abs=1e-12, nan_ok=True) for each in by_parity(solution, 4))
    assert mean == pytest.approx(values[free].mean() / n_prey)
    far = np.abs(np.array(np.divmod(places[free][:, :2, None], 4)) - np.divmod(places[free][:, None, 2:], 4))
    even = (far.sum(axis=0) % 2 == 0).sum(axis=(1, 2))  # the longer way round is as even as the shorter
    assert by_even[2] == pytest.approx(values[free][even == 2].mean() / n_prey)
    assert (len(by_even), np.isnan(by_even).sum()) == ((3, 0) if n_prey == 1 else (5, 2))


@pytest.mark.parametrize("n_prey", [1, 2])
def test_more_time_never_hurts_the_predators(n_prey: int) -> None:
    values = solve(EnvConfig(size=6 if n_prey == 1 else 4, n_prey=n_prey), 12).values
    assert (values[0] == 0).all()
    assert (np.diff(values, axis=0) >= -1e-9).all()
    assert values[-1].max() <= n_prey + 1e-9


def test_a_second_prey_draws_predators_off_and_can_only_add_to_the_prey_caught() -> None:
    one, two = (solve(EnvConfig(size=4, n_predators=2, n_prey=n_prey), 6) for n_prey in (1, 2))
    cells = np.array([(a, b, 0, c) for a, b, c in product(range(1, 16), repeat=3) if c not in (a, b)])
    of_one = one.value(cells[:, :3], 6)
    assert (two.value(cells, 6) >= of_one - 1e-9).all()
    assert (two.value(cells, 6) <= of_one + one.value(cells[:, [0, 1, 3]], 6) + 1e-9).all()


def test_threads_change_nothing() -> None:
    for n_prey in (1, 2):
        one, two = (solve(EnvConfig(size=4, n_prey=n_prey), 4, threads=threads).values for threads in (1, 2))
        assert one.tobytes() == two.tobytes()


@pytest.mark.parametrize("n_prey", [1, 2])
def test_memory_is_known_before_it_is_taken(n_prey: int) -> None:
    config = EnvConfig(size=8 if n_prey == 1 else 5, n_prey=n_prey)
    solve(config, 1)  # or what compiling takes would count
    tracemalloc.start()
    by_parity(solve(config, 3), 3)
    _, taken = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert taken / 1.5 <= memory_needed(config, 3) <= 1.5 * taken


def test_what_does_not_fit_is_refused_with_the_figure() -> None:
    with pytest.raises(MemoryError, match=r"^[\d,]+\.\d GB are needed, [\d,.]+ are free$"):
        solve(EnvConfig(size=100), 150)


def test_the_share_that_is_solved_is_told() -> None:
    told: list[float] = []
    solve(EnvConfig(size=6, n_prey=1), 4, told.append)
    assert told == sorted(told)
    assert told[-1] == 1


@pytest.mark.parametrize("fields", [{"n_prey": 1}, {"n_predators": 2, "move_order": "prey_first"}])
def test_a_saved_game_is_the_same_again(fields: dict[str, Any], tmp_path: Path) -> None:
    solution = solve(EnvConfig(size=4, **fields), 3)
    solution.save(tmp_path / "game")
    again = Solution.load(tmp_path / "game")
    assert again.config == solution.config
    assert again.horizon == 3
    assert again.values.tobytes() == solution.values.tobytes()
    assert all((a == b).all() for a, b in zip(again.states, solution.states, strict=True))
    assert (tmp_path / "game").stat().st_size < solution.values.nbytes + 2000


def test_a_damaged_game_is_refused(tmp_path: Path) -> None:
    solution = solve(EnvConfig(size=4, n_prey=1), 2)
    (tmp_path / "cut").write_bytes(b"no game")
    with pytest.raises(DamagedFileError, match="is damaged"):
        Solution.load(tmp_path / "cut")
    Solution(solution.config.replace(size=5), *list(vars(solution).values())[1:]).save(tmp_path / "other")
    with pytest.raises(DamagedFileError, match=r"must have shape \(turns, 355\), got \(3, 124\)"):
        Solution.load(tmp_path / "other")


def test_games_in_turns_have_a_turn_for_each_side() -> None:
    prey, predators = turns_of(EnvConfig(size=4, n_prey=1, move_order="prey_first"))
    assert prey.cell.shape == (16, 1, 4)
    assert predators.cell.shape == (16, 5, 1)
    assert prey.cell[1, 0].tolist() == [13, 5, 0, 2]  # one to the north; the prey goes east, west, north, south
    assert prey.caught[1, 0].tolist() == [False, False, True, False]
    assert predators.cell[1, :, 0].tolist() == [5, 13, 2, 0, 1]
    assert predators.caught[1, :, 0].tolist() == [False, False, False, True, False]


def test_a_game_whose_observation_is_missing_is_not_called_damaged(tmp_path: Path) -> None:
    solution = solve(EnvConfig(size=4, n_prey=1), 2)
    elsewhere = solution.config.model_copy(update={"observation": "nowhere:Near"})
    Solution(elsewhere, *list(vars(solution).values())[1:]).save(tmp_path / "game")
    with pytest.raises(PartError, match=r"game: observation nowhere:Near cannot be imported: ModuleNotFoundError"):
        Solution.load(tmp_path / "game")
