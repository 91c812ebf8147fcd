"""Pictures are looked at where something must be seen: ``at(frame, config, cell, dx, dy)`` is the colour that lies so
many radii of an agent east and north of a cell's centre.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pygame
import pytest

from predprey_env import EnvConfig, PredPreyEnv
from predprey_env.rendering import sprites
from predprey_env.rendering.colours import CAUGHT, GRID, GROUND, INK, PREDATOR, PREY, Colour, mix
from predprey_env.rendering.picture import HEADER, SIDE, Painter, agent_radius, trail_length
from predprey_env.rendering.track import Track

Cell = tuple[int, int]
ONE_EACH = EnvConfig(n_predators=1, n_prey=1)
HEADINGS = {"E": (1, 0), "W": (-1, 0), "N": (0, 1), "S": (0, -1)}


def drawn(env: PredPreyEnv) -> np.ndarray:
    frame = env.render()
    assert isinstance(frame, np.ndarray)
    return frame


def start(cells: list[Cell], config: EnvConfig = ONE_EACH) -> PredPreyEnv:
    env = PredPreyEnv(config, "rgb_array")
    env.reset(options={"starts": cells})
    return env


def walk(env: PredPreyEnv, *words: str, render: bool = True) -> np.ndarray:
    """The frame after steps, one letter of EWNSI an agent, all of them seen or only the last."""
    for word in words:
        env.step(dict(zip(env.possible_agents, ("EWNSI".index(letter) for letter in word), strict=True)))
        if render:
            env.render()
    return drawn(env)


def at(frame: np.ndarray, config: EnvConfig, cell: Cell, dx: float = 0, dy: float = 0) -> Colour:
    scale, radius = SIDE / config.size, agent_radius(config)
    column, up = (cell[0] + 0.5) * scale + dx * radius, (cell[1] + 0.5) * scale + dy * radius
    red, green, blue = frame[HEADER + int((SIDE - up) % SIDE), int(column % SIDE)].tolist()
    return red, green, blue


def shows(frame: np.ndarray, colour: Colour) -> np.ndarray:
    """Where in the world a colour is: bool ``(SIDE, SIDE)``."""
    found: np.ndarray = (frame[HEADER:] == colour).all(axis=-1)
    return found


def is_empty(frame: np.ndarray) -> np.ndarray:
    """Where there is only ground."""
    return np.all((frame[HEADER:] >= GROUND) & (frame[HEADER:] <= GRID), axis=-1)


def test_a_picture_shows_teams_the_caught_and_north_above() -> None:
    config = EnvConfig(n_predators=2)
    env = start([(10, 20), (70, 20), (10, 80), (69, 20)], config)
    frame = walk(env, "IIWE")
    assert frame.shape == (672, 640, 3)
    assert frame.dtype == np.uint8
    assert frame.flags.c_contiguous
    assert at(frame, config, (10, 20), dx=-0.75) == at(frame, config, (70, 20), dx=-0.75) == PREDATOR
    assert at(frame, config, (9, 80), 0.6, 0.6) == PREY
    assert at(frame, config, (40, 50), dx=2) == GROUND
    assert is_empty(frame).mean() > 0.97
    frame = walk(env, *["IWEE"] * 6)
    assert at(frame, config, (70, 20), 0.62, 0) == CAUGHT
    assert at(frame, config, (70, 20)) == at(frame, config, (70, 20), 0.3, 0.3) == GROUND  # its cross


def test_an_agent_at_the_edge_shows_on_both_sides() -> None:
    orange = shows(drawn(start([(0, 0), (50, 50)])), PREDATOR)
    half = SIDE // 2
    for quarter in (orange[:half, :half], orange[:half, half:], orange[half:, :half], orange[half:, half:]):
        assert quarter.sum() > 20
    blue = shows(drawn(start([(50, 50), (50, 99)])), PREY)
    assert blue[0].any()
    assert blue[-1].any()


def test_one_that_goes_over_the_edge_glides_there_on_both_sides() -> None:
    env = start([(99, 30), (50, 60)])
    env.render()
    walk(env, "EW")
    track, painter = env._viewer._track, env._viewer._painter
    pictures = [pygame.surfarray.array3d(painter.paint(track, progress)).swapaxes(0, 1) for progress in (0.25, 0.75)]
    for picture in pictures:
        full = ~is_empty(picture)[int(SIDE * 0.65) : int(SIDE * 0.75)]
        assert full[:, 0].any()
        assert full[:, -1].any()
        assert not full[:, 40:-40].any()
    # A step is 6.4 pixels wide; the disc's eastern end, without its nose, is on the left side of the picture.
    right_ends = [np.flatnonzero(shows(picture, PREDATOR)[:, :100].any(axis=0)).max() for picture in pictures]
    assert right_ends[1] - right_ends[0] == pytest.approx(3.2, abs=1)


@pytest.mark.parametrize("progress", [0.0, 0.25, 0.5, 1.0])
def test_on_its_way_an_agent_is_between_its_cells(progress: float) -> None:
    config = EnvConfig(n_predators=1, n_prey=1, size=20)
    env = start([(4, 10), (15, 5)], config)
    env.render()
    walk(env, "NS")
    picture = env._viewer._painter.paint(env._viewer._track, progress)
    orange = shows(pygame.surfarray.array3d(picture).swapaxes(0, 1), PREDATOR)
    lowest = SIDE - 1 - np.flatnonzero(orange.any(axis=1)).max()
    assert lowest + agent_radius(config) == pytest.approx((10.5 + progress) * SIDE / 20, abs=1.5)


def test_predators_are_round_and_prey_square() -> None:
    frame = drawn(start([(20, 20), (70, 70)]))
    for corner in ((1, 1), (-1, 1), (1, -1), (-1, -1)):
        assert at(frame, ONE_EACH, (20, 20), *(0.85 * way for way in corner)) == GROUND
        assert at(frame, ONE_EACH, (70, 70), *(0.62 * way for way in corner)) == PREY
    assert at(frame, ONE_EACH, (20, 20), dx=0.85) == PREDATOR
    assert at(frame, ONE_EACH, (70, 70), dx=0.9) != PREY


@pytest.mark.parametrize("letter", HEADINGS)
def test_a_predator_points_where_it_went(letter: str) -> None:
    config = EnvConfig(n_predators=1, n_prey=1, size=20)
    env = start([(5, 5), (15, 15)], config)
    env.render()
    walk(env, letter + "W")
    frame = walk(env, "IW")  # and still does when it idles
    east, north = HEADINGS[letter]
    cell = (5 + east, 5 + north)
    noses = {way for way in HEADINGS.values() if at(frame, config, cell, 1.3 * way[0], 1.3 * way[1]) == PREDATOR}
    assert noses == {(east, north)}


def test_agents_of_a_team_are_told_apart() -> None:
    looks = []
    for swapped in (False, True):
        cells = [(20, 20), (70, 20), (20, 70), (70, 70)]
        order = [1, 0, 3, 2] if swapped else [0, 1, 2, 3]
        looks.append(drawn(start([cells[i] for i in order], EnvConfig(n_predators=2))))
    places = [(c, r) for c in (20, 70) for r in (20, 70)]
    for column, row in places:
        x, y = int((column + 0.5) * 6.4), HEADER + int(SIDE - (row + 0.5) * 6.4)
        first, second = (frame[y - 8 : y + 9, x - 8 : x + 9] for frame in looks)
        assert (first != second).any()


def test_a_trail_fades_with_age_to_nothing() -> None:
    length = int(trail_length(ONE_EACH))
    env = start([(0, 20), (90, 60)])
    env.render()
    frame = walk(env, *["EN"] * 80)  # the prey passes over the edge to row 40
    trail = [at(frame, ONE_EACH, (80 - age, 20), dx=0.5 / 13)[0] for age in range(4, 80)]
    assert trail[0] > 0.6 * PREDATOR[0]
    assert all(younger >= older for younger, older in pairwise(trail))
    assert trail[10] > trail[20] > trail[30] > mix(GRID, 1)[0]
    assert all(at(frame, ONE_EACH, (80 - age, 20), dy=0.1) in (GROUND, GRID) for age in range(length + 1, 78))
    assert at(frame, ONE_EACH, (90, 30))[2] > mix(GRID, 1)[2]


def test_a_trail_goes_on_at_the_other_side() -> None:
    env = start([(95, 20), (50, 70)])
    env.render()
    frame = walk(env, *["EN"] * 12)  # to column 7
    row = ~is_empty(frame)[int(SIDE - 20.5 * 6.4)]
    assert row[int(95.5 * 6.4) : SIDE].all()
    assert row[: int(4 * 6.4)].all()
    assert not row[int(12 * 6.4) : int(94 * 6.4)].any()


def test_steps_that_were_not_rendered_leave_no_trail() -> None:
    env = start([(10, 20), (50, 50)])
    env.render()
    frame = walk(env, *["EN"] * 12, render=False)
    assert is_empty(frame)[:, : int(20 * 6.4)].all()
    assert at(frame, ONE_EACH, (22, 20), dx=-0.75) == PREDATOR
    frame = walk(env, "EN", "EN", "EN", "EN")
    assert at(frame, ONE_EACH, (23, 20)) not in (GROUND, GRID)
    assert at(frame, ONE_EACH, (21, 20)) in (GROUND, GRID)


def test_trails_vanish_at_a_reset() -> None:
    env = start([(10, 20), (50, 50)])
    env.render()
    seen = walk(env, *["EN"] * 10)
    cells = [(20, 20), (50, 60)]
    env.reset(options={"starts": cells})
    assert (drawn(env) == drawn(start(cells))).all()
    assert (drawn(env) != seen).any()


def test_an_environment_that_is_set_back_is_seen_anew() -> None:
    env = start([(10, 20), (50, 50)])
    before = env.state()
    env.render()
    walk(env, *["EN"] * 5)
    earlier = start([(10, 20), (50, 50)])
    assert (earlier.state() == before).all()
    env._world, env._steps = earlier._world, earlier._steps
    assert (drawn(env) == drawn(earlier)).all()


def test_a_capture_is_ringed_for_a_while() -> None:
    config = EnvConfig(n_predators=1, n_prey=2)
    env = start([(20, 20), (21, 20), (70, 70)], config)
    env.render()
    frame = walk(env, "EWN")  # they trade places, and nobody is caught
    assert at(frame, config, (20, 20), dy=2.1) == GROUND
    env.reset(options={"starts": [(20, 20), (22, 20), (70, 70)]})
    env.render()
    frame = walk(env, "EWN")
    ringed = [at(frame, config, (21, 20), dx, dy) for dx, dy in ((1.93, 0), (0, 1.93), (0, -1.93))]
    assert all(min(colour) > 150 for colour in ringed)
    frame = walk(env, *["EIN"] * 14)
    assert all(at(frame, config, (21, 20), 0, dy) in (GROUND, GRID) for dy in np.arange(1.2, 4, 0.05))
    assert at(frame, config, (21, 20), 0.6, 0.6) == CAUGHT


def test_while_agents_are_on_their_way_nobody_is_caught_yet() -> None:
    env = start([(20, 20), (22, 20)])
    env.render()
    walk(env, "EW")
    painter, track = env._viewer._painter, env._viewer._track
    pictures = [pygame.surfarray.array3d(painter.paint(track, progress)).swapaxes(0, 1) for progress in (0.9, 1.0)]
    assert [shows(picture, PREY).any() for picture in pictures] == [True, False]


def test_the_line_above_counts_steps_and_the_caught() -> None:
    env = start([(20, 20), (22, 20)])
    for step, caught, word in [(0, 0, ""), (1, 1, "EW")]:
        frame = walk(env, *[word] * bool(word))
        for line, left in [(f"step {step} / 150", True), (f"caught {caught} / 1", False)]:
            letters = sprites.write_sprite(line, 26, INK)
            expected = pygame.Surface(letters.get_size(), depth=32)
            expected.fill(GRID)
            expected.blit(letters, (0, 0))
            box = letters.get_rect(midleft=(12, 16)) if left else letters.get_rect(midright=(SIDE - 12, 16))
            found = frame[box.top : box.bottom, box.left : box.right]
            assert (found == pygame.surfarray.array3d(expected).swapaxes(0, 1)).all()


@pytest.mark.parametrize("size", [3, 4, 7, 50, 100, 401, 999, 10_000])
def test_every_agent_shows_in_a_world_of_any_size(size: int) -> None:
    config = EnvConfig(n_predators=1, n_prey=1, size=size)
    frame = drawn(start([(0, 0), (size // 2, size // 2)], config))
    assert at(frame, config, (0, 0), dx=-0.75) == PREDATOR
    assert at(frame, config, (size // 2, size // 2), 0.6, 0.6) == PREY
    assert shows(frame, PREDATOR).sum() > 200
    assert shows(frame, PREY).sum() > 200
    assert is_empty(frame).mean() > 0.6


def test_of_many_agents_each_shows() -> None:
    config = EnvConfig(n_predators=1500, n_prey=1000)
    cells = [(column, row) for row in range(0, 100, 2) for column in range(0, 100, 2)]
    env = start(cells, config)
    frame = drawn(env)
    walked = walk(env, "E" * 1500 + "N" * 1000)
    for picture, moved in ((frame, (0, 0)), (walked, (1, 0))):
        assert all(at(picture, config, (x + moved[0], y)) == PREDATOR for x, y in cells[:1500])
    assert all(at(frame, config, cell) == PREY for cell in cells[1500:])


def test_the_same_moment_looks_the_same_however_often_it_is_drawn() -> None:
    env = start([(20, 20), (70, 70)])
    env.render()
    frame = walk(env, "EN", "NE")
    assert (drawn(env) == frame).all()
    kept = frame.copy()
    walk(env, "EN")
    assert (frame == kept).all()  # a frame is the caller's own


def test_half_steps_are_drawn_as_they_come() -> None:
    config = EnvConfig(n_predators=1, n_prey=1, move_order="prey_first")
    env = start([(20, 20), (70, 70)], config)
    env.render()
    frame = walk(env, "EW")
    assert at(frame, config, (20, 20), dx=-0.75) == PREDATOR
    assert at(frame, config, (69, 70), 0.6, 0.6) == PREY
    frame = walk(env, "EW")
    assert at(frame, config, (21, 20), dx=1.3) == PREDATOR
    assert at(frame, config, (69, 70), 0.6, 0.6) == PREY


def test_a_picture_needs_no_display() -> None:
    program = (
        "from predprey_env import predprey_v0; env = predprey_v0.parallel_env(render_mode='rgb_array');"
        "env.reset(seed=0); frame = env.render(); import pygame; print(frame.std() > 0, pygame.display.get_init())"
    )
    bare = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    bare["SDL_VIDEODRIVER"] = "none"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, env=bare)
    assert done.stdout.split() == ["True", "False"], done.stderr


def test_a_painter_draws_the_start_of_an_episode(make_world: Callable[..., object]) -> None:
    painter = Painter(ONE_EACH)
    track = Track(make_world([(20, 20)], [(70, 70)]), 0, 100, 8)
    assert painter.paint(track).get_size() == (SIDE, SIDE + HEADER)
