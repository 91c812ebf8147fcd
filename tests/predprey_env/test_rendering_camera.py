"""The camera that follows the chase: where it looks, and what is in the picture then."""

from __future__ import annotations

import numpy as np
import pygame
import pytest

from predprey_env import EnvConfig
from predprey_env.rendering.camera import Camera
from predprey_env.rendering.colours import PREDATOR, PREY
from predprey_env.rendering.picture import HEADER, SIDE, Painter
from predprey_env.rendering.viewer import Viewer
from predprey_env.rules.dynamics import World

CONFIG = EnvConfig(size=100, n_predators=1, n_prey=2)
MIDDLE = HEADER + SIDE // 2, SIDE // 2


def world(*cells: tuple[int, int], alive: tuple[int, ...] = (1, 1)) -> World:
    x, y = np.array(cells, np.int32).T
    return World(x, y, np.array(alive, np.int32))


def test_it_begins_at_the_free_prey_that_is_nearest_to_a_predator_across_the_edge() -> None:
    assert Camera(100).look(world((99, 50), (30, 50), (2, 50)), 0).tolist() == [2.5, 50.5]
    assert Camera(100).look(world((99, 50), (30, 50), (2, 50), alive=(1, 0)), 0).tolist() == [30.5, 50.5]


def test_it_goes_the_shortest_way_and_a_part_of_it_a_step() -> None:
    camera = Camera(100)
    camera.look(world((0, 0), (98, 50), (50, 50), alive=(1, 0)), 0)
    assert camera.look(world((0, 0), (2, 50), (50, 50), alive=(1, 0)), 1).tolist() == pytest.approx([99.1, 50.5])
    halves = Camera(100)
    halves.look(world((0, 0), (98, 50), (50, 50), alive=(1, 0)), 0)
    for time in (0.5, 1.0):
        found = halves.look(world((0, 0), (2, 50), (50, 50), alive=(1, 0)), time)
    assert found.tolist() == pytest.approx([99.1, 50.5]), "two halves of a step are a step"


def test_it_stays_when_all_are_caught_and_begins_in_the_middle_where_nobody_is_free() -> None:
    camera = Camera(100)
    camera.look(world((0, 0), (98, 50), (50, 50), alive=(1, 0)), 0)
    assert camera.look(world((98, 50), (98, 50), (50, 50), alive=(0, 0)), 9).tolist() == [98.5, 50.5]
    assert Camera(100).look(world((0, 0), (0, 0), (0, 0), alive=(0, 0)), 0).tolist() == [50.0, 50.0]


@pytest.mark.parametrize("prey", [(50, 50), (0, 99), (99, 0), (3, 97)])
def test_the_prey_is_in_the_middle_and_a_predator_six_cells_east_of_it_on_the_right(prey: tuple[int, int]) -> None:
    hunter, other = ((prey[0] + 6) % 100, prey[1]), ((prey[0] + 50) % 100, (prey[1] + 50) % 100)
    frame = Viewer(CONFIG, 10, follow=20).frame(world(hunter, prey, other), 0)
    row, column = MIDDLE
    assert tuple(frame[row, column - 8]) == PREY
    assert tuple(frame[row, column - 8 + 6 * SIDE // 20]) == PREDATOR
    assert (frame == PREY).all(axis=-1).sum() < 40**2, "the other prey is out of the picture"


def test_a_trail_goes_on_over_the_edge() -> None:
    viewer = Viewer(CONFIG, 10, follow=20)
    viewer.frame(world((50, 10), (99, 10), (50, 90)), 0)
    frame = viewer.frame(world((50, 10), (0, 10), (50, 90)), 1)
    row, column = MIDDLE
    # The camera eased 0.15 cells to the east: the prey is 0.85 cells east of the middle, and its trail reaches west.
    assert frame[row, column - 2].tolist() > frame[row, column - 3 * SIDE // 20].tolist()


def test_a_picture_of_the_whole_world_is_the_same_with_the_middle_as_centre() -> None:
    viewer = Viewer(CONFIG, 10)
    whole = viewer.frame(world((20, 30), (70, 60), (5, 5)), 0)
    painter = Painter(CONFIG)
    assert viewer._track is not None
    picture = painter.paint(viewer._track, centre=np.array([50.0, 50.0]))
    again = pygame.surfarray.array3d(picture).swapaxes(0, 1)
    for colour in (PREDATOR, PREY):
        assert np.array_equal((whole == colour).all(axis=-1), (again == colour).all(axis=-1))
