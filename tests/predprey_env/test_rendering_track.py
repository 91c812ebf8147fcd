from __future__ import annotations

from collections.abc import Callable

import numpy as np

from predprey_env.rendering.track import Track
from predprey_env.rules.dynamics import World

MakeWorld = Callable[..., World]


def walk(make_world: MakeWorld, *moments: tuple[float, tuple[int, int]], size: int = 10, length: float = 8) -> Track:
    """What is seen of a predator that is at these times in these cells, and of a prey that stays at (5, 5)."""
    (time, cell), *later = moments
    track = Track(make_world([cell], [(5, 5)]), time, size, length)
    for time, cell in later:
        assert track.see(make_world([cell], [(5, 5)]), time)
    return track


def test_a_step_over_the_edge_is_one_cell_long(make_world: MakeWorld) -> None:
    track = walk(make_world, (0, (9, 0)), (1, (0, 0)), (2, (0, 9)))
    assert [stretch.way[0].tolist() for stretch in track.stretches] == [[1, 0], [0, -1]]
    assert [stretch.start[0].tolist() for stretch in track.stretches] == [[9, 0], [0, 0]]
    assert track.cells[0].tolist() == [0, 9]


def test_in_the_smallest_world_every_step_is_known(make_world: MakeWorld) -> None:
    track = Track(make_world([(0, 0)], [(1, 1)]), 0, 3, 8)
    for time, (cell, way) in enumerate([((2, 0), [-1, 0]), ((0, 0), [1, 0]), ((0, 2), [0, -1]), ((0, 0), [0, 1])], 1):
        track.see(make_world([cell], [(1, 1)]), time)
        assert track.way[0].tolist() == way


def test_where_steps_were_not_seen_there_is_no_trail(make_world: MakeWorld) -> None:
    track = walk(make_world, (0, (1, 1)), (1, (2, 1)), (3, (4, 1)), (4, (5, 1)))
    assert [stretch.time for stretch in track.stretches] == [1, 4]
    track = walk(make_world, (0, (1, 1)), (1, (2, 1)), (3, (4, 1)))
    assert track.way.tolist() == track.heading.tolist() == [[0, 0], [0, 0]]
    assert track.duration == 0


def test_half_steps_are_seen(make_world: MakeWorld) -> None:
    track = walk(make_world, (0, (1, 1)), (0.5, (1, 1)), (1, (2, 1)))
    assert [stretch.way[0].tolist() for stretch in track.stretches] == [[0, 0], [1, 0]]
    assert track.duration == 0.5


def test_the_same_moment_is_seen_once(make_world: MakeWorld) -> None:
    track = walk(make_world, (0, (1, 1)), (1, (2, 1)))
    assert not track.see(make_world([(2, 1)], [(5, 5)]), 1)
    assert len(track.stretches) == 1
    assert track.way[0].tolist() == [1, 0]


def test_one_that_idles_looks_where_it_went(make_world: MakeWorld) -> None:
    track = walk(make_world, (0, (1, 1)), (1, (1, 2)), (2, (1, 2)), (3, (1, 2)))
    assert track.heading[0].tolist() == [0, 1]
    assert track.heading[1].tolist() == [0, 0]


def test_what_is_older_than_a_trail_is_forgotten(make_world: MakeWorld) -> None:
    track = walk(make_world, *[(time, (time % 10, 0)) for time in range(30)], length=8)
    assert [stretch.time for stretch in track.stretches] == list(range(22, 30))


def test_a_capture_has_the_time_at_which_it_was_seen(make_world: MakeWorld) -> None:
    track = Track(make_world([(0, 0)], [(1, 0), (5, 5), (6, 6)], caught=(2,)), 4, 10, 8)
    track.see(make_world([(1, 0)], [(1, 0), (5, 5), (6, 6)], caught=(0, 2)), 5)
    track.see(make_world([(2, 0)], [(1, 0), (5, 5), (6, 6)], caught=(0, 2)), 6)
    assert track.caught_at.tolist() == [5, np.inf, 4]


def test_what_was_seen_does_not_move_with_the_world(make_world: MakeWorld) -> None:
    world = make_world([(1, 1)], [(5, 5)])
    track = Track(world, 0, 10, 8)
    world.x[0] = 2
    assert track.cells[0].tolist() == [1, 1]
