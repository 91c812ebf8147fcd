"""Windows on SDL's dummy display, which shows nothing and else works like any, in a time that passes in them alone."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable, Iterator

import numpy as np
import pygame
import pytest

from predprey_env import EnvConfig, PredPreyEnv
from predprey_env.rendering import window as windows
from predprey_env.rendering.colours import PREDATOR
from predprey_env.rendering.picture import HEADER

SMALL = EnvConfig(n_predators=2, n_prey=2, size=20, max_cycles=10)
Envs = Callable[..., PredPreyEnv]


class Time:
    """Seconds that pass only while a window waits."""

    now = 100.0

    def sleep(self, seconds: float) -> None:
        self.now += seconds


@pytest.fixture(autouse=True)
def time(monkeypatch: pytest.MonkeyPatch) -> Time:
    time = Time()
    monkeypatch.setattr(windows, "perf_counter", lambda: time.now)
    monkeypatch.setattr(windows, "sleep", time.sleep)
    return time


@pytest.fixture
def make(monkeypatch: pytest.MonkeyPatch) -> Iterator[Envs]:
    """``make(render_mode="human", fps=15)``: environments that are closed after the test."""
    made: list[PredPreyEnv] = []

    def make_env(render_mode: str = "human", fps: float = 15) -> PredPreyEnv:
        monkeypatch.setitem(PredPreyEnv.metadata, "render_fps", fps)
        made.append(PredPreyEnv(SMALL, render_mode))
        return made[-1]

    pygame.display.init()
    pygame.event.clear()
    yield make_env
    for env in made:
        env.close()


def window(env: PredPreyEnv) -> pygame.Window | None:
    """What PyGame knows of the environment's window."""
    return None if env._viewer is None or env._viewer._window is None else env._viewer._window._window


def shown(env: PredPreyEnv) -> np.ndarray:
    opened = window(env)
    assert opened is not None
    return pygame.surfarray.array3d(opened.get_surface()).swapaxes(0, 1)


def step(env: PredPreyEnv, action: int = 0) -> None:
    env.step(dict.fromkeys(env.agents, action))


def test_the_window_shows_what_an_array_holds(make: Envs) -> None:
    human, array = make("human"), make("rgb_array")
    for env in (human, array):
        env.reset(seed=3)
    while array.agents:
        assert (shown(human) == array.render()).all()
        for env in (human, array):
            step(env, len(env.agents) % 4)
    assert (shown(human) == array.render()).all()
    assert human.render() is None


def test_nothing_opens_before_a_world_is_there_to_see(make: Envs) -> None:
    env = make()
    assert window(env) is None
    env.reset(seed=0)
    assert window(env) is not None


def test_agents_glide_from_cell_to_cell(make: Envs, monkeypatch: pytest.MonkeyPatch) -> None:
    env = make()
    env.reset(options={"starts": [(5, 5), (5, 15), (2, 10), (3, 10)]})
    edges: list[int] = []
    put = windows.Window._put

    def watched(window: windows.Window, picture: pygame.Surface) -> None:
        orange = (pygame.surfarray.array3d(picture)[:, HEADER:] == PREDATOR).all(axis=-1)
        edges.append(int(np.flatnonzero(orange.any(axis=1)).min()))  # a disc's western edge: its nose is in the east
        put(window, picture)

    monkeypatch.setattr(windows.Window, "_put", watched)
    step(env)
    assert np.diff(edges).tolist() == [8, 8, 8, 8]  # a cell is 32 pixels wide, and a step four sixtieths of a second


@pytest.mark.parametrize("fps", [4, 7, 15, 60, 200])
def test_steps_keep_to_the_frame_rate(make: Envs, time: Time, fps: float) -> None:
    env = make(fps=fps)
    env.reset(seed=0)
    begun = time.now
    for _ in range(9):
        step(env)
    assert time.now - begun == pytest.approx(9 / fps)


def test_a_slow_program_is_not_made_slower(make: Envs, time: Time) -> None:
    env = make()
    env.reset(seed=0)
    begun = time.now
    for _ in range(5):
        time.now += 0.03  # the step is shown in what is left of its time
        step(env)
    assert time.now - begun == pytest.approx(5 / 15)
    time.now += 10
    begun = time.now
    step(env)  # after a pause nothing is made up for
    assert time.now - begun == pytest.approx(1 / 15)


def test_the_end_of_an_episode_stays_for_a_moment(make: Envs, time: Time) -> None:
    env = make()
    env.reset(seed=0)
    while env.agents:
        begun = time.now
        step(env)
    assert time.now - begun == pytest.approx(11 / 15)


def test_what_was_shown_is_shown_again_at_once(make: Envs, time: Time) -> None:
    env = make()
    env.reset(seed=0)
    begun = time.now
    for _ in range(3):
        env.render()
    assert time.now == begun


CLOSED_BY = {
    "button": lambda window: pygame.event.Event(pygame.WINDOWCLOSE, window=window),
    "escape": lambda window: pygame.event.Event(pygame.KEYDOWN, key=pygame.K_ESCAPE, window=window),
    "quit": lambda _: pygame.event.Event(pygame.QUIT),
}


@pytest.mark.parametrize("how", CLOSED_BY)
def test_the_user_may_close_the_window_and_the_program_goes_on(make: Envs, time: Time, how: str) -> None:
    env = make()
    env.reset(seed=0)
    pygame.event.post(CLOSED_BY[how](window(env)))
    begun = time.now
    while env.agents:
        step(env)
    assert env.render() is None
    assert time.now == begun  # nobody watches, so nobody waits
    env.reset(seed=1)
    assert window(env) is None


def test_other_keys_do_not_close_the_window(make: Envs) -> None:
    env = make()
    env.reset(seed=0)
    pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_SPACE, window=window(env)))
    step(env)
    assert window(env) is not None


def test_after_close_there_is_a_window_again(make: Envs) -> None:
    env = make()
    env.close()
    env.reset(seed=0)
    first = window(env)
    env.close()
    env.close()
    assert window(env) is None
    env.reset(seed=0)
    assert window(env) is not None
    assert window(env) is not first


def test_each_environment_has_its_own_window(make: Envs) -> None:
    one, other = make(), make()
    for seed, env in enumerate((one, other)):
        env.reset(seed=seed)
    assert (shown(one) != shown(other)).any()
    pygame.event.post(pygame.event.Event(pygame.WINDOWCLOSE, window=window(other)))
    step(one)
    assert window(one) is not None
    step(other)
    assert window(other) is None
    step(one)
    assert window(one) is not None


def test_a_window_opens_again_after_another_environment_ended_pygame(make: Envs) -> None:
    human, array = make("human"), make("rgb_array")
    for env in (human, array):
        env.reset(seed=0)
        env.render()
    pygame.quit()
    for env in (human, array):
        step(env)
    assert (shown(human) == array.render()).all()
    pygame.quit()
    human.close()


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copy_has_no_window_and_plays_the_same_game(make: Envs, copied: Callable[[PredPreyEnv], PredPreyEnv]) -> None:
    env = make()
    env.reset(seed=0)
    step(env)
    twin = copied(env)
    assert window(twin) is None
    assert window(env) is not None
    if copied is not copy.copy:
        step(env, 2)
        step(twin, 2)
        assert (env.state() == twin.state()).all()
        assert window(twin) is not window(env)
    twin.close()
    assert window(env) is not None


def test_without_a_display_one_line_says_so(make: Envs, monkeypatch: pytest.MonkeyPatch) -> None:
    env = make()
    monkeypatch.setenv("SDL_VIDEODRIVER", "none")
    pygame.display.quit()
    with pytest.raises(RuntimeError, match=r'^render_mode "human" needs a display, none not available; "rgb_array"'):
        env.reset(seed=0)


def test_a_display_that_nobody_asked_for_and_nobody_sees_is_none(make: Envs, monkeypatch: pytest.MonkeyPatch) -> None:
    env = make()
    monkeypatch.delenv("SDL_VIDEODRIVER")
    monkeypatch.setattr(pygame.display, "get_driver", lambda: "offscreen")
    with pytest.raises(RuntimeError, match=r'^render_mode "human" needs a display, found none; "rgb_array"'):
        env.reset(seed=0)
