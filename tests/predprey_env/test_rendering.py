from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from predprey_env import EnvConfig, PredPreyEnv
from predprey_env.dynamics import World
from predprey_env.rendering import INK, PAPER, PREDATOR, PREY, picture, text

MakeWorld = Callable[..., World]


def test_text_shows_teams_the_caught_and_north_above(make_world: MakeWorld) -> None:
    world = make_world([(0, 0), (3, 3)], [(1, 0), (2, 2)], caught=(1,))
    title, _, *body, bottom = text(world, EnvConfig(n_predators=2, size=4), steps=7).split("\n")
    assert body == ["│···2│", "│··x·│", "│····│", "│1a··│"]
    assert bottom == "└────┘"
    assert title == "step 7/150, caught 1/2"


def test_in_text_a_predator_hides_the_prey_under_it(make_world: MakeWorld) -> None:
    world = make_world([(1, 1)], [(1, 1)], caught=(0,))
    frame = text(world, EnvConfig(n_predators=1, n_prey=1, size=3), 0)
    assert "│·1·│" in frame
    assert "x" not in frame


def test_a_large_world_is_drawn_smaller(make_world: MakeWorld) -> None:
    world = make_world([(0, 0), (99, 99)], [(50, 50), (99, 0)])
    _, _, *body, _ = text(world, EnvConfig(n_predators=2), 0).split("\n")
    assert [len(line) for line in body] == [52] * 25
    assert (body[0][50], body[24][1], body[24][50], body[12][26]) == ("2", "1", "b", "a")


@pytest.mark.parametrize("size", [10, 26, 40, 100, 101])
def test_all_lines_below_the_title_are_equally_long(size: int) -> None:
    env = PredPreyEnv(EnvConfig(size=size), "ansi")
    env.reset(seed=0)
    assert len({len(line) for line in env.render().split("\n")[1:]}) == 1


def _pixel(frame: np.ndarray, cell: tuple[int, int], size: int = 100) -> tuple[int, ...]:
    scale = len(frame) / size
    return tuple(frame[int((size - cell[1] - 0.5) * scale), int((cell[0] + 0.5) * scale)].tolist())


def test_a_picture_shows_teams_the_caught_and_north_above(make_world: MakeWorld) -> None:
    world = make_world([(10, 20), (70, 20)], [(10, 80), (70, 80)], caught=(1,))
    frame = picture(world, EnvConfig(n_predators=2))
    assert frame.shape == (400, 400, 3)
    assert frame.dtype == np.uint8
    assert [_pixel(frame, cell) for cell in [(10, 20), (70, 20), (10, 80), (70, 80)]] == [PREDATOR, PREDATOR, PREY, INK]
    assert _pixel(frame, (40, 50)) == PAPER
    assert (frame == PAPER).all(axis=-1).mean() > 0.95


def test_an_agent_at_the_edge_shows_on_both_sides_of_a_picture(make_world: MakeWorld) -> None:
    frame = picture(make_world([(0, 0)], [(50, 50)]), EnvConfig(n_predators=1, n_prey=1))
    corners = [frame[row, column] for row in (0, -1) for column in (0, -1)]
    assert [tuple(corner.tolist()) for corner in corners] == [PREDATOR] * 4


def test_predators_are_round_and_prey_square(make_world: MakeWorld) -> None:
    frame = picture(make_world([(20, 20)], [(70, 70)]), EnvConfig(n_predators=1, n_prey=1))
    for colour, share in [(PREDATOR, np.pi / 4), (PREY, 1)]:
        rows, columns = np.nonzero((frame == colour).all(axis=-1))
        box = (np.ptp(rows) + 1) * (np.ptp(columns) + 1)
        assert len(rows) / box == pytest.approx(share, abs=0.09)


@pytest.mark.parametrize("size", [3, 7, 100, 401])
def test_every_agent_shows_in_a_picture_of_any_size(make_world: MakeWorld, size: int) -> None:
    frame = picture(make_world([(0, 0)], [(size // 2, size // 2)]), EnvConfig(n_predators=1, n_prey=1, size=size))
    assert _pixel(frame, (0, 0), size) == PREDATOR
    assert _pixel(frame, (size // 2, size // 2), size) == PREY


def test_the_environment_renders_as_asked(capsys: pytest.CaptureFixture[str]) -> None:
    frames = {}
    for mode in ("ansi", "rgb_array", "human", None):
        env = PredPreyEnv(EnvConfig(size=30), mode)
        env.reset(seed=0)
        env.step(dict.fromkeys(env.agents, 0))
        capsys.readouterr()
        frames[mode] = env.render()
    assert "step 1/150" in frames["ansi"]
    assert frames["rgb_array"].shape == (390, 390, 3)
    assert frames["human"] is frames[None] is None


def test_human_mode_prints_at_every_reset_and_step(capsys: pytest.CaptureFixture[str]) -> None:
    env = PredPreyEnv(EnvConfig(size=30), "human")
    env.reset(seed=0)
    assert "step 0/150" in capsys.readouterr().out
    env.step(dict.fromkeys(env.agents, 0))
    assert "step 1/150" in capsys.readouterr().out


def test_the_last_world_can_be_rendered_after_the_end() -> None:
    env = PredPreyEnv(EnvConfig(size=30, max_cycles=1), "ansi")
    env.reset(seed=0)
    env.step(dict.fromkeys(env.agents, 0))
    assert env.agents == []
    assert "step 1/1" in env.render()
