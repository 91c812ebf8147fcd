from __future__ import annotations

from collections.abc import Callable
from itertools import combinations_with_replacement, product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from predprey_env import EnvConfig
from predprey_env.rules.dynamics import (
    EVERYBODY,
    NOBODY,
    PREDATORS,
    PREY,
    World,
    count_alive,
    predators_turn,
    prey_turn,
    remember_moves,
    step,
)
from predprey_env.rules.starts import draw_each, draw_starts, given_starts

EAST, WEST, NORTH, SOUTH, IDLE = range(5)
MakeWorld = Callable[..., World]


def config(n_predators: int = 1, n_prey: int = 1, size: int = 10, **fields: object) -> EnvConfig:
    return EnvConfig(n_predators=n_predators, n_prey=n_prey, size=size, **fields)


def moved(world: World, actions: list[int], rules_of: EnvConfig) -> World:
    """A whole time step, in turns where the rules say so."""
    turns = [prey_turn, predators_turn] if rules_of.rules.prey_first else [step]
    for turn in turns:
        turn(world, np.array(actions, np.int32), rules_of.rules)
    return world


def cell(world: World, agent: int) -> tuple[int, int]:
    return int(world.x[agent]), int(world.y[agent])


# -- moves --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("start", "action", "end"),
    [
        ((4, 4), EAST, (5, 4)),
        ((4, 4), WEST, (3, 4)),
        ((4, 4), NORTH, (4, 5)),
        ((4, 4), SOUTH, (4, 3)),
        ((4, 4), IDLE, (4, 4)),
        ((9, 4), EAST, (0, 4)),
        ((0, 4), WEST, (9, 4)),
        ((4, 9), NORTH, (4, 0)),
        ((4, 0), SOUTH, (4, 9)),
    ],
)
def test_each_action_moves_one_cell_and_wraps_round(make_world: MakeWorld, start, action: int, end) -> None:
    assert cell(moved(make_world([start], [(7, 7)]), [action, EAST], config()), 0) == end
    if action != IDLE:
        assert cell(moved(make_world([(7, 7)], [start]), [IDLE, action], config()), 1) == end


@pytest.mark.parametrize("move_order", ["simultaneous", "prey_first"])
def test_everybody_takes_its_own_action(make_world: MakeWorld, move_order: str) -> None:
    world = make_world([(0, 0), (2, 0)], [(4, 4), (8, 8)])
    moved(world, [EAST, SOUTH, WEST, NORTH], config(2, 2, move_order=move_order))
    assert [cell(world, agent) for agent in range(4)] == [(1, 0), (2, 9), (3, 4), (8, 9)]
    assert world.alive.tolist() == [1, 1]


# -- captures -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("move_order", ["simultaneous", "prey_first"])
def test_a_prey_is_caught_in_the_cell_where_both_arrive(make_world: MakeWorld, move_order: str) -> None:
    world = moved(make_world([(3, 5)], [(5, 5)]), [EAST, WEST], config(move_order=move_order))
    assert cell(world, 0) == cell(world, 1) == (4, 5)
    assert world.alive.tolist() == [0]


def test_a_prey_that_leaves_as_the_predator_arrives_escapes(make_world: MakeWorld) -> None:
    assert moved(make_world([(4, 5)], [(5, 5)]), [EAST, EAST], config()).alive.tolist() == [1]


def test_a_predator_catches_all_prey_in_its_cell_and_no_other(make_world: MakeWorld) -> None:
    world = make_world([(4, 5)], [(5, 4), (6, 5), (6, 6)])
    assert moved(world, [EAST, NORTH, WEST, WEST], config(1, 3)).alive.tolist() == [0, 0, 1]


def test_any_predator_catches(make_world: MakeWorld) -> None:
    world = make_world([(0, 0), (6, 5), (9, 9)], [(4, 5)])
    assert moved(world, [IDLE, WEST, IDLE, EAST], config(3)).alive.tolist() == [0]


def test_a_shared_column_or_row_alone_is_no_capture(make_world: MakeWorld) -> None:
    world = make_world([(5, 0), (0, 5)], [(5, 4)])
    assert moved(world, [IDLE, IDLE, NORTH], config(2)).alive.tolist() == [1]


def test_a_prey_that_trades_places_with_a_predator_escapes(make_world: MakeWorld) -> None:
    world = moved(make_world([(4, 5)], [(5, 5)]), [EAST, WEST], config())
    assert [cell(world, 0), cell(world, 1)] == [(5, 5), (4, 5)]
    assert world.alive.tolist() == [1]


@pytest.mark.parametrize(("predator", "prey"), [((4, 5), (5, 5)), ((9, 5), (0, 5))])
def test_a_prey_that_trades_places_is_caught_where_swaps_capture(make_world: MakeWorld, predator, prey) -> None:
    world = moved(make_world([predator], [prey]), [EAST, WEST], config(swap_captures=True))
    assert world.alive.tolist() == [0]
    assert cell(world, 0) == cell(world, 1) == prey  # caught before it could move


def test_swaps_capture_who_trades_places_and_nobody_else(make_world: MakeWorld) -> None:
    """Every way in which two that stand near each other can move; the prey is the second of its team."""
    rules_of = {swap_captures: config(1, 2, size=8, swap_captures=swap_captures) for swap_captures in (False, True)}
    for x, y, action, escape in product((6, 7, 0, 1, 2), (6, 7, 0, 1, 2), range(5), range(4)):
        worlds = {
            swap_captures: moved(make_world([(0, 0)], [(4, 4), (x, y)]), [action, EAST, escape], rules)
            for swap_captures, rules in rules_of.items()
        }
        traded = (cell(worlds[False], 0), cell(worlds[False], 2)) == ((x, y), (0, 0))
        assert worlds[True].alive.tolist() == [1, 0 if traded else worlds[False].alive[1]]


def test_walking_after_one_another_is_no_swap(make_world: MakeWorld) -> None:
    world = make_world([(4, 5), (6, 6)], [(5, 5)])
    assert moved(world, [EAST, WEST, EAST], config(2, swap_captures=True)).alive.tolist() == [1]


def test_a_prey_that_walks_onto_a_predators_old_cell_is_caught_only_where_prey_move_first(
    make_world: MakeWorld,
) -> None:
    actions = [NORTH, WEST]  # the prey enters the cell that the predator leaves
    assert moved(make_world([(4, 5)], [(5, 5)]), actions, config()).alive.tolist() == [1]
    assert moved(make_world([(4, 5)], [(5, 5)]), actions, config(move_order="prey_first")).alive.tolist() == [0]


def test_a_prey_that_moves_first_is_caught_by_the_predator_that_follows(make_world: MakeWorld) -> None:
    world = moved(make_world([(4, 5)], [(5, 4)]), [EAST, NORTH], config(move_order="prey_first"))
    assert world.alive.tolist() == [0]


def test_swap_captures_changes_nothing_where_prey_move_first(make_world: MakeWorld) -> None:
    """There a swap is a walk into the predator, which captures anyway."""
    for swap_captures in (False, True):
        rules_of = config(move_order="prey_first", swap_captures=swap_captures)
        world = moved(make_world([(4, 5)], [(5, 5)]), [EAST, WEST], rules_of)
        assert world.alive.tolist() == [0]
        assert [cell(world, 0), cell(world, 1)] == [(5, 5), (4, 5)]


@pytest.mark.parametrize("swap_captures", [False, True])
@pytest.mark.parametrize("move_order", ["simultaneous", "prey_first"])
def test_a_caught_prey_stays_caught_and_where_it_is(make_world: MakeWorld, move_order: str, swap_captures) -> None:
    rules_of = config(1, 2, move_order=move_order, swap_captures=swap_captures)
    world = make_world([(4, 5)], [(5, 5), (0, 0)], caught=(0,))
    for action in (EAST, WEST, NORTH, SOUTH):
        moved(world, [IDLE, action, EAST], rules_of)
        assert cell(world, 1) == (5, 5)
        assert world.alive.tolist() == [0, 1]


def test_count_alive_counts_the_free(make_world: MakeWorld) -> None:
    cells = [(0, 0), (1, 1), (2, 2)]
    for caught, alive in [((), 3), ((1,), 2), ((0, 2), 1), ((0, 1, 2), 0)]:
        assert count_alive(make_world([(9, 9)], cells, caught), config(1, 3).rules) == alive


# -- facts about the game -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("swap_captures", [False, True])
def test_three_predators_cannot_close_the_four_exits_of_a_prey(make_world: MakeWorld, swap_captures) -> None:
    steps = {EAST: (1, 0), WEST: (-1, 0), NORTH: (0, 1), SOUTH: (0, -1), IDLE: (0, 0)}
    # Every way to arrive in the prey's cell or next to it; who arrives elsewhere closes nothing.
    arrivals = [((5 + x - dx, 5 + y - dy), a) for x, y in steps.values() for a, (dx, dy) in steps.items()]
    rules_of = config(3, swap_captures=swap_captures)
    for team in combinations_with_replacement(arrivals, 3):
        cells, actions = zip(*team, strict=True)
        outcomes = (moved(make_world(cells, [(5, 5)]), [*actions, escape], rules_of) for escape in range(4))
        assert any(world.alive[0] for world in outcomes), team


def test_four_predators_can(make_world: MakeWorld) -> None:
    cells, actions = [(7, 5), (3, 5), (5, 7), (5, 3)], [WEST, EAST, SOUTH, NORTH]
    worlds = [moved(make_world(cells, [(5, 5)]), [*actions, escape], config(4)) for escape in range(4)]
    assert [int(world.alive[0]) for world in worlds] == [0, 0, 0, 0]


@given(half=st.integers(2, 5), seed=st.integers(0, 2**32 - 1))
def test_on_an_even_torus_a_restless_predator_at_odd_distance_never_catches(half: int, seed: int) -> None:
    rules_of, random = config(3, 2, size=2 * half), np.random.default_rng(seed)
    places = draw_starts(random, 1, rules_of)[0]
    world = World(*places.T.copy(), np.ones(2, np.int32))
    odd = [(i, 3 + j) for i, j in product(range(3), range(2)) if (places[i] - places[3 + j]).sum() % 2]
    for _ in range(60):
        free = {3 + j for j in range(2) if world.alive[j]}
        moved(world, random.integers(0, 4, 5).tolist(), rules_of)
        assert not any(cell(world, predator) == cell(world, prey) for predator, prey in odd if prey in free)


def test_idling_once_makes_up_for_odd_distance(make_world: MakeWorld) -> None:
    world = moved(make_world([(4, 5)], [(5, 5)]), [IDLE, WEST], config())
    assert world.alive.tolist() == [0]


def test_on_an_odd_torus_the_way_round_makes_up_for_odd_distance(make_world: MakeWorld) -> None:
    world = make_world([(0, 0)], [(3, 0)])  # 3 steps one way, 4 the other, on a torus of 7
    moved(moved(world, [WEST, EAST], config(size=7)), [WEST, EAST], config(size=7))
    assert cell(world, 0) == (5, 0)
    assert world.alive.tolist() == [0]


# -- starts -------------------------------------------------------------------------------------------------------


def _collisions(starts: np.ndarray, n_predators: int) -> int:
    pairs = starts[:, :n_predators, None] == starts[:, None, n_predators:]
    return int(pairs.all(axis=-1).any(axis=(1, 2)).sum())


def test_starts_are_cells_of_the_torus_and_all_of_them() -> None:
    starts = draw_starts(np.random.default_rng(0), 500, config(3, 2, size=5))
    assert starts.shape == (500, 5, 2)
    assert starts.dtype == np.int32
    assert {tuple(place) for place in starts.reshape(-1, 2).tolist()} == set(product(range(5), range(5)))


def test_starts_on_a_preys_cell_are_drawn_again_unless_allowed() -> None:
    drawn = {
        choice: draw_starts(np.random.default_rng(0), 500, config(3, 2, size=5, start_collisions=choice))
        for choice in ("redraw", "allow")
    }
    assert _collisions(drawn["redraw"], 3) == 0
    assert _collisions(drawn["allow"], 3) > 50  # 3 x 2 pairs, 25 cells: about 110 of 500
    assert (drawn["redraw"][:, 0] == drawn["redraw"][:, 1]).all(axis=1).any()  # predators may share a cell


def test_a_prey_that_is_drawn_again_may_land_anywhere_and_all_others_stay() -> None:
    allowed, drawn_again = (
        draw_starts(np.random.default_rng(0), 2000, config(3, 2, size=5, start_collisions=choice))
        for choice in ("allow", "redraw")
    )
    met = (allowed[:, :3, None] == allowed[:, None, 3:]).all(axis=-1).any(axis=1)
    landed = drawn_again[:, 3:][met]
    assert {tuple(place) for place in landed.tolist()} == set(product(range(5), range(5)))
    np.testing.assert_array_equal(drawn_again[:, :3], allowed[:, :3])
    np.testing.assert_array_equal(drawn_again[:, 3:][~met], allowed[:, 3:][~met])


@pytest.mark.parametrize("choice", ["redraw", "allow"])
def test_each_of_many_generators_draws_the_start_that_it_draws_alone(choice: str) -> None:
    crowded = config(4, 2, size=3, start_collisions=choice)
    together, alone = ([np.random.default_rng(seed) for seed in range(100)] for _ in range(2))
    for _ in range(2):  # the second time from where the first left each generator
        expected = np.concatenate([draw_starts(generator, 1, crowded) for generator in alone])
        starts = draw_each(together, crowded)
        np.testing.assert_array_equal(starts, expected)
        assert starts.dtype == expected.dtype


@pytest.mark.parametrize("cells", [[(0, 0), (0, 0)], [(9, 9), (9, 0)], [(1, 2), (8, 7)]])
def test_any_cells_of_the_torus_may_be_given_as_starts(cells: list[tuple[int, int]]) -> None:
    starts = given_starts(cells, config())
    assert starts.tolist() == [list(place) for place in cells]
    assert starts.dtype == np.int32


def test_equal_generators_draw_equal_starts() -> None:
    first, again, other = (draw_starts(np.random.default_rng(seed), 20, config(3, 2)) for seed in (5, 5, 6))
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()


def test_a_crowded_start_is_found_in_few_draws() -> None:
    """50 predators and 50 prey on 100 cells: a legal configuration, and there are plenty of legal starts."""

    class Patience(np.random.Generator):
        draws = 0

        def integers(self, *args, **kwargs) -> np.ndarray:
            self.draws += 1
            assert self.draws < 2_000, "2,000 draws and no start"
            return super().integers(*args, **kwargs)

    crowded = config(50, 50, size=10)
    starts = draw_starts(Patience(np.random.PCG64(0)), 1, crowded)
    assert _collisions(starts, 50) == 0


@pytest.mark.parametrize(
    ("turn", "expected"),
    [
        (NOBODY, [4, 4, 4, 4]),
        (EVERYBODY, [0, 1, 2, 3]),
        (PREY, [4, 4, 4, 3]),
        (PREDATORS, [0, 1, 2, 4]),
    ],
)
def test_the_last_moves_are_those_of_who_moves_in_the_turn(turn: int, expected: list[int]) -> None:
    moved = np.full(4, 4, np.int32)
    remember_moves(np.array([0, 1, 2, 3], np.int32), turn, EnvConfig(n_predators=3, n_prey=1).rules, moved)
    assert moved.tolist() == expected
