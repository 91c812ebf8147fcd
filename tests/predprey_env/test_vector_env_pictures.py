"""Pictures of vector environments: those of single worlds, one for each row."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest

from predprey_env import parallel_vector_env, team_view, vector_env

WORLD: dict[str, Any] = {"n_prey": 1, "size": 9, "max_cycles": 6}


def test_a_row_shows_what_a_team_view_shows() -> None:
    envs = vector_env(3, "predators", "flee_nearest", "SameStep", render_mode="rgb_array", **WORLD)
    view = team_view("predators", "flee_nearest", render_mode="rgb_array", **WORLD)
    envs.reset(seed=4)
    view.reset(seed=5)  # the seed of the second world
    generator, ended = np.random.default_rng(0), 0
    for _ in range(15):
        pictures = envs.render()
        assert pictures is not None
        assert (pictures[4] == view.render()).all()
        actions = generator.integers(0, 5, 9)
        envs.step(actions)
        view.step({f"predator_{i}": int(actions[3 + i]) for i in range(3)})
        if not view.agents:
            view.reset()
            ended += 1
    assert ended >= 2


def test_there_is_a_picture_for_each_row() -> None:
    envs = vector_env(5, "predators", "random", render_mode="rgb_array", **WORLD)
    envs.reset(seed=0)
    pictures = envs.render()
    assert pictures is not None
    assert len(pictures) == envs.num_envs == 15
    assert (pictures[0] == pictures[2]).all(), "three agents of one world"
    assert (pictures[0] != pictures[3]).any(), "another world"
    assert (pictures[-1] == pictures[12]).all()
    assert [each.shape for each in pictures[::3]] == [(672, 640, 3)] * 5
    with pytest.raises(IndexError):
        pictures[15]


def test_a_new_episode_has_no_trails_of_the_last() -> None:
    envs = vector_env(1, "predators", "random", render_mode="rgb_array", **WORLD)
    envs.reset(seed=0)
    fresh = envs.render()[0]
    envs.reset(seed=1)
    assert (envs.render()[0] != fresh).any()
    for _ in range(3):
        envs.step(np.zeros(3, int))
        envs.render()[0]
    envs.reset(seed=0)
    assert (envs.render()[0] == fresh).all()


def test_pictures_follow_the_chase_where_asked() -> None:
    whole, close = (
        vector_env(1, "predators", "random", render_mode="rgb_array", follow=follow, **WORLD) for follow in (None, 5)
    )
    for envs in (whole, close):
        envs.reset(seed=0)
    assert (whole.render()[0] != close.render()[0]).any()


def test_both_teams_are_shown_too() -> None:
    envs = parallel_vector_env(4, render_mode="rgb_array", **WORLD)
    envs.reset(seed=0)
    pictures = envs.render()
    assert pictures is not None
    assert len(pictures) == 4
    assert pictures[3].shape == (672, 640, 3)


def test_without_a_mode_nothing_is_drawn() -> None:
    envs = vector_env(2, "predators", "random", **WORLD)
    envs.reset(seed=0)
    assert envs.render() is None
    assert envs.render_mode is None


def test_an_environment_that_has_drawn_can_be_pickled() -> None:
    envs = vector_env(2, "predators", "random", render_mode="rgb_array", **WORLD)
    envs.reset(seed=0)
    envs.render()[0]
    twin = pickle.loads(pickle.dumps(envs))
    assert (twin.render()[3] == envs.render()[3]).all()


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"render_mode": "human"}, "render_mode must be None or rgb_array, got 'human'"),
        ({"render_mode": "rgb_array", "follow": 10}, "follow must be at most 9, the size of the world, got 10"),
        ({"follow": 2}, "follow must be an integer of at least 5, got 2"),
    ],
)
def test_pictures_that_cannot_be_drawn_are_refused(options: Any, says: str) -> None:
    with pytest.raises(ValueError, match=f"^{says}$"):
        vector_env(2, "predators", "random", **options, **WORLD)


def test_there_is_nothing_to_draw_before_the_first_reset() -> None:
    envs = vector_env(2, "predators", "random", render_mode="rgb_array", **WORLD)
    with pytest.raises(RuntimeError, match=r"^reset\(\) must be called before render\(\)$"):
        envs.render()


def test_videos_of_gymnasium_are_recorded(tmp_path: Any) -> None:
    recording = pytest.importorskip("gymnasium.wrappers.vector", reason="older Gymnasium records no vector env")
    if not hasattr(recording, "RecordVideo"):
        pytest.skip("older Gymnasium records no vector env")
    envs = vector_env(2, "predators", "random", render_mode="rgb_array", **WORLD)
    recorder = recording.RecordVideo(envs, str(tmp_path), episode_trigger=lambda n: n == 0, record_first_only=True)
    recorder.reset(seed=0)
    for _ in range(8):
        recorder.step(recorder.action_space.sample())
    recorder.close()
    assert [path.suffix for path in tmp_path.iterdir()] == [".mp4"]
