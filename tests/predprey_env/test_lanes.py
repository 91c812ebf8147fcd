"""The vector operations against NumPy, and blocks of worlds against each of their worlds."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from predprey_env import EnvConfig
from predprey_env.config import TEAMS
from predprey_env.jit.compilation import entry_point, rule
from predprey_env.jit.lanes import LANES, any_of, load, store, where
from predprey_env.rules.dynamics import EVERYBODY, World, count_alive, predators_turn, prey_turn, remember_moves, step
from predprey_env.rules.observation import observe
from predprey_env.rules.starts import draw_starts

if TYPE_CHECKING:
    from collections.abc import Callable

    from predprey_env.config import Rules

INTEGERS = np.array([-7, -3, -2, -1, 0, 0, 1, 2, 3, 5, 7, 9, 100, -100, 2**31 - 1, -(2**31)], np.int32)
OTHERS = np.roll(INTEGERS, 5)
OTHERS[OTHERS == 0] = 4  # INTEGERS / 0 is nobody's business
FLOATS = np.array([-2.5, -1, -0.0, 0, 0.1, 1 / 3, 1, 1.5, 2, 3, 1e-40, 1e30, -1e30, np.inf, -np.inf, 7], np.float32)
MORE = np.roll(FLOATS, 3)


@cache
def _applied(function: Callable[..., Any]) -> tuple[Callable[..., None], ...]:
    """A rule of two values over two rows of lanes, and over a row and a number; compiled once for each type."""
    compiled = rule(function)

    @njit(_nrt=False)
    def apply_to_both(a, b, out):
        compiled(load(a, 0), load(b, 0), out)

    @njit(_nrt=False)
    def apply_to_left(a, number, out):
        compiled(load(a, 0), number, out)

    @njit(_nrt=False)
    def apply_to_right(number, b, out):
        compiled(number, load(b, 0), out)

    return apply_to_both, apply_to_left, apply_to_right


def on_lanes(function: Callable[..., None], a: Any, b: Any, n_rows: int = 1, dtype: Any = None) -> np.ndarray:
    """What a rule stores of two values, each lanes (an array) or a number that the compiler repeats in all lanes."""
    lanes = [value for value in (a, b) if isinstance(value, np.ndarray)]
    out = np.zeros((n_rows, LANES), dtype or lanes[0].dtype)
    apply = _applied(function)[0 if len(lanes) == 2 else 1 if lanes[0] is a else 2]
    apply(*(value[None] if isinstance(value, np.ndarray) else value for value in (a, b)), out)
    return out


def _compare(a, b, out):
    less = where(a < b, 1, 0) + where(a <= b, 2, 0)
    greater = where(a > b, 4, 0) + where(a >= b, 8, 0)
    store(out, 0, less + greater + where(a == b, 16, 0) + where(a != b, 32, 0))


def compared(a: Any, b: Any) -> list[int]:
    """A bit for each comparison that holds, in each lane."""
    return on_lanes(_compare, a, b, dtype=np.int32)[0].tolist()


def compared_by_numpy(a: Any, b: Any) -> list[int]:
    holds = [a < b, a <= b, a > b, a >= b, a == b, a != b]
    return (np.array(holds).T @ [1, 2, 4, 8, 16, 32]).tolist()


def identical(found: np.ndarray, expected: np.ndarray) -> bool:
    """Bit for bit, signs of zero included; all NaN are one."""
    nan = np.isnan(expected.astype(np.float64))
    return (
        found.dtype == expected.dtype
        and (np.isnan(found) == nan).all()
        and found[~nan].tobytes() == expected[~nan].tobytes()
    )


# -- operators ----------------------------------------------------------------------------------------------------


def _calculate(a, b, out):
    store(out, 0, a + b)
    store(out, 1, a - b)
    store(out, 2, a * b)


def _divide(a, b, out):
    store(out, 0, a / b)


@pytest.mark.parametrize(("a", "b"), [(INTEGERS, OTHERS), (INTEGERS, 3), (-3, OTHERS)])
def test_integer_arithmetic_is_that_of_numpy(a, b) -> None:
    with np.errstate(over="ignore"):
        assert identical(on_lanes(_calculate, a, b, 3), np.stack([a + b, a - b, a * b]))


@pytest.mark.parametrize(("a", "b"), [(FLOATS, MORE), (FLOATS, 3), (FLOATS, np.float32(0.1)), (0.1, MORE)])
def test_float_arithmetic_is_that_of_numpy(a, b) -> None:
    with np.errstate(all="ignore"):
        assert identical(on_lanes(_calculate, a, b, 3), np.stack([a + b, a - b, a * b]))
        assert identical(on_lanes(_divide, a, b), np.stack([a / b]))


@pytest.mark.parametrize(("a", "b"), [(INTEGERS, OTHERS), (INTEGERS, 2), (0, OTHERS), (INTEGERS, INTEGERS)])
def test_integers_compare_as_in_numpy(a, b) -> None:
    assert compared(a, b) == compared_by_numpy(a, b)


@pytest.mark.parametrize(("a", "b"), [(FLOATS, MORE), (FLOATS, 1.5), (1, MORE), (FLOATS, FLOATS)])
def test_floats_compare_as_in_numpy(a, b) -> None:
    assert compared(a, b) == compared_by_numpy(a, b)


def test_nan_compares_as_in_numpy() -> None:
    a, b = FLOATS.copy(), MORE.copy()
    a[:5] = b[3:8] = np.nan
    assert compared(a, b) == compared_by_numpy(a, b)


def test_masks_combine_as_in_numpy() -> None:
    def combine(a, b, out):
        store(out, 0, where((a > 0) & (b < 3), 1, 0))
        store(out, 1, where((a > 0) | (b < 3), 1, 0))

    high, low = INTEGERS > 0, OTHERS < 3
    assert on_lanes(combine, INTEGERS, OTHERS, 2).tolist() == [(high & low).tolist(), (high | low).tolist()]


# -- selection, memory --------------------------------------------------------------------------------------------


def _greater(a, b, out):
    store(out, 0, where(a > b, a, b))


@pytest.mark.parametrize(("a", "b"), [(INTEGERS, OTHERS), (INTEGERS, -8), (9, OTHERS), (FLOATS, MORE), (0.1, FLOATS)])
def test_where_selects_lane_by_lane(a, b) -> None:
    assert identical(on_lanes(_greater, a, b)[0], np.where(a > b, a, b))


def test_where_takes_two_numbers_as_they_are() -> None:
    """And keeps the fraction of a number beside an integer."""

    def select(a, b, out):
        store(out, 0, where(a > b, 2.5, 0.1))
        store(out, 1, where(a > b, 1, 0.5))

    found = on_lanes(select, FLOATS, MORE, 2)
    assert identical(found[0], np.where(FLOATS > MORE, np.float32(2.5), np.float32(0.1)))
    assert identical(found[1], np.where(FLOATS > MORE, np.float32(1), np.float32(0.5)))


def test_any_of_asks_all_lanes() -> None:
    @njit(_nrt=False)
    def any_above(values, bound):
        return any_of(load(values, 0) > bound)

    for hot in range(LANES):
        values = np.zeros((1, LANES), np.int32)
        values[0, hot] = 5
        assert any_above(values, 4)
        assert not any_above(values, 5)
    assert any_above(np.array([5], np.int32), 4)
    assert not any_above(np.array([5], np.int32), 5)


@pytest.mark.parametrize("dtype", [np.int32, np.float32])
def test_a_row_is_loaded_and_stored_and_its_neighbours_left_alone(dtype) -> None:
    @njit(_nrt=False)
    def copy_row(source, row, target, to):
        store(target, to, load(source, row))

    source = np.arange(3 * LANES).reshape(3, LANES).astype(dtype)
    target = np.full((4, LANES), -1, dtype)
    copy_row(source, 1, target, 2)
    assert target[2].tolist() == source[1].tolist()
    assert (target[[0, 1, 3]] == -1).all()


@pytest.mark.parametrize("dtype", [np.int32, np.float32])
def test_a_number_is_stored_in_every_lane(dtype) -> None:
    @njit(_nrt=False)
    def fill_row(target, row, number):
        store(target, row, number)

    target = np.zeros((2, LANES), dtype)
    fill_row(target, 1, 3)
    assert target.tolist() == [[0] * LANES, [3] * LANES]


# -- whole rules --------------------------------------------------------------------------------------------------


@entry_point
def _play(world: World, actions: Any, rules: Rules, moved: Any, seen: Any, free: Any) -> None:
    """One step of a world or of a block of worlds; all views and the number of free prey after it."""
    if rules.prey_first:
        prey_turn(world, actions, rules)
        predators_turn(world, actions, rules)
    else:
        step(world, actions, rules)
    remember_moves(actions, EVERYBODY, rules, moved)
    row = 0
    for agent in range(rules.n_predators + rules.n_prey):
        row = observe(rules.sight, world, moved, agent, rules, seen, row)
    store(free, 0, count_alive(world, rules))


@pytest.mark.parametrize("swap_captures", [False, True])
@pytest.mark.parametrize("move_order", ["simultaneous", "prey_first"])
@settings(max_examples=15)
@given(config=st.from_type(EnvConfig), seed=st.integers(0, 2**32 - 1))
def test_a_block_of_worlds_plays_like_each_of_them_alone(move_order, swap_captures, config: EnvConfig, seed) -> None:
    config = config.replace(move_order=move_order, swap_captures=swap_captures)
    n_prey, random = config.n_prey, np.random.default_rng(seed)
    x, y = np.ascontiguousarray(draw_starts(random, LANES, config).transpose(2, 1, 0))
    block = World(x, y, random.integers(0, 2, (n_prey, LANES), np.int32))
    alone = [World(*(rows[:, lane].copy() for rows in block)) for lane in range(LANES)]
    n_seen = sum(shape.n_agents * shape.n_seen for shape in map(config.team, TEAMS))
    moved, moved_alone = np.zeros((config.n_agents, LANES), np.int32), np.zeros(config.n_agents, np.int32)
    seen, seen_alone = np.empty((n_seen, LANES), np.float32), np.empty(n_seen, np.float32)
    free, free_alone = np.empty((1, LANES), np.int32), np.empty(1, np.int32)

    for _ in range(12):
        actions = random.integers(0, 5, (config.n_agents, LANES), np.int32)
        _play(block, actions, config.rules, moved, seen, free)
        for lane, world in enumerate(alone):
            _play(world, actions[:, lane].copy(), config.rules, moved_alone, seen_alone, free_alone)
            assert all(rows[:, lane].tobytes() == row.tobytes() for rows, row in zip(block, world, strict=True))
            assert seen[:, lane].tobytes() == seen_alone.tobytes()
            assert free[0, lane] == free_alone[0]


@entry_point
def _branch(rows: Any, out: Any) -> None:
    if load(rows, 0) > 0:
        store(out, 0, load(rows, 0))


def test_a_condition_on_lanes_is_refused_with_what_to_write() -> None:
    rows = np.zeros((1, LANES), np.float32)
    with pytest.raises(
        ValueError, match=r"does not compile: if, .* need one truth, .*; use where\(\), & and \|$"
    ) as refused:
        _branch(rows, rows)
    assert "test_lanes.py, line" in str(refused.value)
