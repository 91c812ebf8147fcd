from __future__ import annotations

from collections.abc import Callable

import pytest

from predprey_env import EnvConfig, PredPreyEnv
from predprey_env.rendering import text
from predprey_env.rules.dynamics import World

MakeWorld = Callable[..., World]


def test_text_shows_teams_the_caught_and_north_above(make_world: MakeWorld) -> None:
    world = make_world([(0, 0), (3, 3)], [(1, 0), (2, 2)], caught=(1,))
    title, top, *body, bottom = text(world, EnvConfig(n_predators=2, size=4), steps=7).split("\n")
    assert body == ["│ · · · 1 │", "│ · · x · │", "│ · · · · │", "│ 0 a · · │"]
    assert (top, bottom) == ("┌─────────┐", "└─────────┘")
    assert title == "step 7/150, caught 1/2"


def test_in_text_a_predator_hides_the_prey_under_it(make_world: MakeWorld) -> None:
    world = make_world([(1, 1)], [(1, 1)], caught=(0,))
    frame = text(world, EnvConfig(n_predators=1, n_prey=1, size=3), 0)
    assert "│ · 0 · │" in frame
    assert "x" not in frame.split("\n", 1)[1]


def test_no_free_prey_looks_like_a_caught_one(make_world: MakeWorld) -> None:
    world = make_world([(0, 0)], [(i % 10, 2 + i // 10) for i in range(60)])
    body = text(world, EnvConfig(n_predators=1, n_prey=60, size=10), 0).split("\n", 1)[1]
    assert "x" not in body
    assert sum(map(str.isalpha, body)) == 60


def test_a_large_world_is_drawn_smaller(make_world: MakeWorld) -> None:
    world = make_world([(0, 0), (99, 99)], [(50, 50), (99, 0)])
    _, _, *body, _ = text(world, EnvConfig(n_predators=2), 0).split("\n")
    assert (body[0][41], body[19][2], body[19][41], body[9][22]) == ("1", "0", "b", "a")


@pytest.mark.parametrize("size", [3, 10, 19, 20, 21, 26, 40, 100, 101, 10_000])
def test_a_frame_and_a_prompt_fit_a_terminal_of_80_by_24(size: int) -> None:
    env = PredPreyEnv(EnvConfig(size=size), "ansi")
    env.reset(seed=0)
    title, *box = str(env.render()).split("\n")
    assert len(box) + 2 <= 24
    assert len(title) < 80
    (width,) = {len(line) for line in box}
    assert width < 80
    assert width == 2 * (len(box) - 2) + 3  # square, as characters are twice as high as wide
