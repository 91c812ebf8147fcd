"""Episodes kept whole: as the environment plays them, as text, as pictures, and with what is seen in them."""

from __future__ import annotations

import numpy as np
import pytest

from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.moments import best_moment
from esp_trainer.analysis.replay import Trajectory, as_pictures, as_text, captions, play_episode, seen_in
from predprey_env import EnvConfig, PredPreyEnv
from predprey_env.policies import ScriptedTeam
from predprey_env.rules.dynamics import World


def scripted(env: EnvConfig, seed: int = 0, predators: str = "surround", prey: str = "flee_nearest") -> Trajectory:
    teams = ScriptedTeam.of(predators, "predators", env), ScriptedTeam.of(prey, "prey", env)
    return play_episode(*teams, env, seed)


def made(cells: np.ndarray, env: EnvConfig, caught: tuple[int, ...] = ()) -> Trajectory:
    """An episode of these cells ``(n_steps + 1, n_agents, 2)``, each prey caught at that step."""
    alive = [[int(t < at) for at in caught] or [1] * env.n_prey for t in range(len(cells))]
    worlds = tuple(World(step[:, 0], step[:, 1], np.array(free)) for step, free in zip(cells, alive, strict=True))
    return Trajectory(env, worlds, tuple(float(t) for t in range(len(cells))))


@pytest.mark.parametrize("order", ["simultaneous", "prey_first"])
def test_an_episode_is_the_environments(order: str) -> None:
    env = EnvConfig(size=16, max_cycles=40, move_order=order)  # type: ignore[arg-type]
    episode = scripted(env, seed=3)
    game = PredPreyEnv(env, "ansi")
    observations, _ = game.reset(seed=3)
    teams = ScriptedTeam.of("surround", "predators", env), ScriptedTeam.of("flee_nearest", "prey", env)
    frames = [game.render()]
    while game.agents:
        observations, *_ = game.step(teams[0].act(observations) | teams[1].act(observations))
        frames.append(game.render())
    assert list(as_text(episode)) == frames
    halves = 2 if order == "prey_first" else 1
    assert len(episode.times) == halves * (len(episode.cells) - 1) + 1
    assert episode.times[-1] == len(episode.cells) - 1


def test_its_pictures_are_the_environments_with_a_caption() -> None:
    env = EnvConfig(size=16, max_cycles=40)
    episode = scripted(env, seed=3)
    game = PredPreyEnv(env, "rgb_array")
    game.reset(options={"starts": episode.cells[0]})
    plain = game.render()
    assert isinstance(plain, np.ndarray)
    pictures = list(as_pictures(episode, fps=12))
    assert len(pictures) == len(episode.times)
    assert (pictures[0][32:] == plain[32:]).all()
    named = [bool(name) for name in captions(episode)]
    assert True in named
    # The middle of the line above the world is empty or holds the caption.
    ground = plain[16, 320]
    written = [bool((picture[4:28, 200:440] != ground).any()) for picture in pictures]
    assert written == named


def chase(n_steps: int) -> np.ndarray:
    """A predator on the heels of a prey that runs east, and stays there."""
    t = np.arange(n_steps + 1)
    agents = [np.stack([t + at, np.full_like(t, 50)], axis=1) for at in (10, 13)]
    return np.stack(agents, axis=1).astype(np.int32)


def test_what_is_seen_is_named_while_it_lasts_and_for_a_while_after() -> None:
    env = EnvConfig(n_predators=1, n_prey=1)
    cells = chase(70)
    cells[41:, 0] = cells[40, 0]  # then it stands still
    episode = made(cells, env)
    rows = seen_in(episode)["attacker"]
    last = int(np.flatnonzero(rows)[-1])
    assert rows[: last + 1].all()
    names = captions(episode)
    assert set(names[: last + 1]) == {"attacker"}
    assert names[last + 15] == "attacker"
    assert names[last + 16] == ""


def test_a_capture_of_two_at_once_is_seen_at_the_end() -> None:
    env = EnvConfig(size=16, max_cycles=60)
    for seed in range(40):
        episode = scripted(env, seed)
        if "simultaneous capture" in seen_in(episode):
            assert np.flatnonzero(seen_in(episode)["simultaneous capture"]).tolist() == [len(episode.cells) - 1]
            return
    raise AssertionError("no such capture in 40 episodes")


def test_the_best_moment_is_of_the_episode_in_which_it_lasts_longest() -> None:
    env = EnvConfig(n_predators=1, n_prey=1, max_cycles=60)
    short, long = chase(60), chase(60)
    short[26:, 0] = short[25, 0]
    trace = np.stack([short, long])
    paths = Paths.of_trace(trace, env.n_predators, env.size)
    moment = best_moment("attacker", trace, paths)
    assert moment is not None
    assert (moment.step, moment.until) == (0, 60)
    assert (moment.cells == long).all()
    assert moment.shown == (0, 38)  # 30 steps of it at most, and 8 more
    assert best_moment("blocker", trace, paths) is None
    first = best_moment("attacker", trace[:1], Paths.of_trace(trace[:1], env.n_predators, env.size))
    assert first is not None
    assert first.shown == (0, first.until + 8)
    assert 25 <= first.until < 30
