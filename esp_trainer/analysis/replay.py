"""An episode of two policies: its trajectory, and its frames as text or as pictures with captions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.behaviours.registry import BEHAVIOURS
from esp_trainer.arrays import BoolMask, Cells, Steps
from predprey_env import PredPreyEnv
from predprey_env.arrays import Picture
from predprey_env.config import EnvConfig
from predprey_env.extras import require_pygame
from predprey_env.policies import Policy
from predprey_env.rendering import text
from predprey_env.rules.dynamics import World

_LONG_ENOUGH = 15  # steps that a name stays in the caption, so that it can be read
_WIDEST = 44  # most characters of a caption


@dataclass(frozen=True)
class Trajectory:
    """All moments of an episode: the start, and the world after each call of ``step``.

    Where teams move in turns, a call is half a time step.
    """

    env: EnvConfig
    worlds: tuple[World, ...]
    times: tuple[float, ...]
    """Time of each moment, in steps."""

    @property
    def cells(self) -> Cells:
        """Cells of all agents after each whole step, int32 ``(n_steps + 1, n_agents, 2)``, predators first."""
        whole = [world for world, time in zip(self.worlds, self.times, strict=True) if time == int(time)]
        return np.stack([np.stack([world.x, world.y], axis=1) for world in whole])

    def paths(self) -> Paths:
        """Return the episode in the form that the behaviours' detectors read."""
        cells = np.full((1, self.env.max_cycles + 1, self.env.n_agents, 2), -1, np.int32)
        cells[0, : len(self.cells)] = self.cells
        return Paths.of_trace(cells, self.env.n_predators, self.env.size, self.caught_at[None])

    @property
    def caught_at(self) -> Steps:
        """Step in which each prey was caught, counted from 1, or 0 if it was not: int ``(n_prey,)``."""
        caught = np.array([world.alive for world in self.worlds]) == 0
        steps = np.ceil(self.times).astype(np.int64)
        return np.where(caught.any(axis=0), steps[caught.argmax(axis=0)], 0)


def play_episode(predators: Policy, prey: Policy, env: EnvConfig, seed: int = 0) -> Trajectory:
    """Return the episode of two policies from a seed."""
    game = PredPreyEnv(env)
    observations, infos = game.reset(seed=seed)
    predators.reset(seed)
    prey.reset(seed)
    worlds, times = [_world(game)], [0.0]
    while game.agents:
        seen = {agent: view for agent, view in observations.items() if infos[agent]["in_turn"]}
        hunters = {agent: view for agent, view in seen.items() if agent.startswith("predator")}
        hunted = {agent: view for agent, view in seen.items() if agent.startswith("prey")}
        observations, _, _, _, infos = game.step({**predators.act(hunters), **prey.act(hunted)})
        worlds.append(_world(game))
        times.append(float(game.state()[-1]) * env.max_cycles)
    return Trajectory(env, tuple(worlds), tuple(np.round(times, 1).tolist()))


def _world(game: PredPreyEnv) -> World:
    n, state = game.config.n_agents, game.state().astype(np.int32)
    return World(state[:n], state[n : 2 * n], state[2 * n : -1])


def as_text(episode: Trajectory) -> Iterator[str]:
    """Yield a frame of text for each moment."""
    for world, time in zip(episode.worlds, episode.times, strict=True):
        yield text(world, episode.env, int(np.ceil(time)))


def as_pictures(episode: Trajectory, fps: float, follow: int | None = None) -> Iterator[Picture]:
    """Yield an RGB picture of each moment, uint8 ``(height, width, 3)``, with the names of the behaviours seen.

    With ``follow``, pictures are that many cells wide and follow the chase; else they show the whole world.

    Raises :class:`gymnasium.error.DependencyNotInstalled` without pygame-ce.
    """
    require_pygame("a picture")
    from predprey_env.rendering.viewer import Viewer

    viewer, names = Viewer(episode.env, fps, follow), captions(episode)
    for world, time in zip(episode.worlds, episode.times, strict=True):
        yield viewer.frame(world, time, names[int(time)]).copy()


def captions(episode: Trajectory) -> list[str]:
    """Return the names of the behaviours that are seen after each whole step, or were just before.

    Each line names the rarest behaviours first, and leaves out those that do not fit.
    """
    found = seen_in(episode)
    lines = []
    for step in range(len(episode.cells)):
        names = [name for name, rows in found.items() if rows[max(0, step - _LONG_ENOUGH) : step + 1].any()]
        names.sort(key=lambda name: int(found[name].sum()))
        while len(", ".join(names)) > _WIDEST:
            names.pop()
        lines.append(", ".join(names))
    return lines


def seen_in(episode: Trajectory) -> dict[str, BoolMask]:
    """Return the whole steps at which each behaviour is seen, bool ``(n_steps + 1,)``; leave out those never seen."""
    paths, n_rows = episode.paths(), len(episode.cells)
    rows = {name: detector.rows(paths)[0, :n_rows] for name, detector in BEHAVIOURS.items() if detector.of_interaction}
    return {name: seen for name, seen in rows.items() if seen.any()}
