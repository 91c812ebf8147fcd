from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from predprey_env.rules.torus import displacement, largest_distance, magnitude, manhattan, wrap

SIZES = st.integers(3, 10_000)


@pytest.mark.parametrize(
    ("size", "coordinate", "cell"),
    [(100, -1, 99), (100, 0, 0), (100, 99, 99), (100, 100, 0), (101, 100, 100), (101, 101, 0), (101, -1, 100)],
)
def test_a_step_over_the_edge_comes_out_on_the_other_side(size: int, coordinate: int, cell: int) -> None:
    assert wrap(coordinate, size) == cell


@pytest.mark.parametrize("size", [3, 4, 7])
def test_wrap_is_the_remainder_over_its_whole_range(size: int) -> None:
    coordinates = range(-size, 2 * size)
    assert [wrap(coordinate, size) for coordinate in coordinates] == [coordinate % size for coordinate in coordinates]


@pytest.mark.parametrize(
    ("size", "start", "end", "way"),
    [
        (100, 0, 49, 49),
        (100, 0, 51, -49),
        (100, 99, 0, 1),
        (100, 0, 99, -1),
        (100, 30, 30, 0),
        (101, 0, 50, 50),
        (101, 0, 51, -50),
        (101, 51, 0, 50),
        (101, 50, 0, -50),
    ],
)
def test_displacement_takes_the_shorter_way(size: int, start: int, end: int, way: int) -> None:
    assert displacement(start, end, size) == way


@pytest.mark.parametrize(("start", "end"), [(0, 50), (50, 0), (75, 25), (25, 75)])
def test_the_antipode_of_an_even_torus_lies_on_the_negative_side_of_both(start: int, end: int) -> None:
    assert displacement(start, end, 100) == -50


@pytest.mark.parametrize(("size", "ways"), [(100, range(-50, 50)), (101, range(-50, 51)), (3, range(-1, 2))])
def test_displacements_fill_the_range_that_the_observation_space_promises(size: int, ways: range) -> None:
    assert sorted(displacement(0, end, size) for end in range(size)) == list(ways)


@given(size=SIZES, data=st.data())
def test_displacement_leads_from_start_to_end_by_the_shortest_way(size: int, data: st.DataObject) -> None:
    start, end = data.draw(st.tuples(st.integers(0, size - 1), st.integers(0, size - 1)))
    way = displacement(start, end, size)
    assert (start + way) % size == end
    assert abs(way) == min((end - start) % size, (start - end) % size)
    assert displacement(end, start, size) == (way if 2 * way == -size else -way)


def test_magnitude_drops_the_sign() -> None:
    assert [magnitude(number) for number in range(-3, 4)] == [3, 2, 1, 0, 1, 2, 3]


def test_manhattan_adds_the_two_legs() -> None:
    assert [manhattan(dx, dy) for dx, dy in [(3, 4), (-3, 4), (-3, -4), (0, 0)]] == [7, 7, 7, 0]


@pytest.mark.parametrize(("size", "distance"), [(100, 100), (101, 100), (8, 8), (7, 6), (3, 2)])
def test_the_largest_distance_is_the_one_to_the_farthest_cell(size: int, distance: int) -> None:
    ways = [displacement(0, end, size) for end in range(size)]
    assert largest_distance(size) == max(manhattan(dx, dy) for dx in ways for dy in ways) == distance
