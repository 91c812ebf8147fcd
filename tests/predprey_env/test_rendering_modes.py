"""How the environment renders, with and without what that needs."""

from __future__ import annotations

import subprocess
import sys
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from gymnasium.error import DependencyNotInstalled

from predprey_env import EnvConfig, PredPreyEnv, predprey_v0

SMALL = EnvConfig(size=30, max_cycles=3)


def test_the_environment_renders_as_asked() -> None:
    frames = {}
    for mode in ("ansi", "rgb_array", "human", None):
        env = PredPreyEnv(SMALL, mode)
        env.reset(seed=0)
        env.step(dict.fromkeys(env.agents, 0))
        frames[mode] = env.render()
        env.close()
    assert isinstance(frames["ansi"], str)
    assert "step 1/3" in frames["ansi"]
    assert isinstance(frames["rgb_array"], np.ndarray)
    assert frames["rgb_array"].shape == (672, 640, 3)
    assert frames["human"] is frames[None] is None


def test_nobody_prints(capfd: pytest.CaptureFixture[str]) -> None:
    for mode in ("ansi", "rgb_array", "human"):
        env = PredPreyEnv(SMALL, mode)
        env.reset(seed=0)
        env.render()
        env.close()
    assert capfd.readouterr().out == ""


def test_the_last_world_can_be_rendered_after_the_end() -> None:
    env = PredPreyEnv(EnvConfig(size=30, max_cycles=1), "ansi")
    env.reset(seed=0)
    env.step(dict.fromkeys(env.agents, 0))
    assert env.agents == []
    assert "step 1/1" in str(env.render())


def test_an_environment_that_draws_nothing_remembers_nothing() -> None:
    env = PredPreyEnv(SMALL, "rgb_array")
    env.reset(seed=0)
    env.step(dict.fromkeys(env.agents, 0))
    assert env._viewer is None


def test_the_time_limit_in_a_picture_is_that_of_the_episode() -> None:
    env, other = PredPreyEnv(SMALL, "rgb_array"), PredPreyEnv(SMALL.replace(max_cycles=77), "rgb_array")
    env.reset(seed=0)
    env.render()
    env.max_cycles = 77
    for each in (env, other):
        each.reset(seed=0)
    assert (np.asarray(env.render()) == np.asarray(other.render())).all()


def test_the_turn_based_face_renders_too() -> None:
    env = predprey_v0.env(size=30, render_mode="rgb_array")
    env.reset(seed=0)
    for agent in env.possible_agents:
        assert agent == env.agent_selection
        env.step(0)
    parallel = PredPreyEnv(EnvConfig(size=30), "rgb_array")
    parallel.reset(seed=0)
    parallel.step(dict.fromkeys(parallel.agents, 0))
    assert (env.render() == np.asarray(parallel.render())).all()


@pytest.mark.parametrize("mode", ["human", "rgb_array"])
def test_without_pygame_one_line_names_what_to_install(mode: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pygame", None)
    line = rf'^render_mode "{mode}" needs pygame-ce: pip install "predprey-esp\[render\]"$'
    with pytest.raises(DependencyNotInstalled, match=line):
        PredPreyEnv(SMALL, mode)


def test_the_other_pygame_is_told_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    other = ModuleType("pygame")
    other.version = SimpleNamespace(ver="2.6.1")  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "pygame", other)
    with pytest.raises(DependencyNotInstalled, match=r"needs pygame-ce 2\.5\.2 or later, got pygame 2\.6\.1: pip unin"):
        PredPreyEnv(SMALL, "human")


def test_text_needs_no_extra() -> None:
    program = (
        "import sys; sys.modules['pygame'] = sys.modules['imageio_ffmpeg'] = None;"
        "from predprey_env import predprey_v0; env = predprey_v0.parallel_env(size=4, render_mode='ansi');"
        "env.reset(seed=0); assert 'step 0/150' in env.render(); env.close()"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_pictures_are_loaded_when_they_are_asked_for() -> None:
    program = "import sys, predprey_env.rendering; print('pygame' in sys.modules, 'imageio_ffmpeg' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.stdout.split() == ["False", "False"], done.stderr
