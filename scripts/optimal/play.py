"""What optimal play looks like: two optimal teams against each other."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from tqdm import tqdm

from esp_trainer.analysis.behaviours.counts import BehaviourRate, count_behaviours
from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.behaviours.registry import BEHAVIOURS
from esp_trainer.analysis.behaviours.thresholds import Thresholds
from esp_trainer.analysis.replay import Episode, as_pictures, play
from esp_trainer.exact.solution import Solution, by_parity, solve
from esp_trainer.exact.team import OptimalTeam
from predprey_env.config import EnvConfig
from predprey_env.rendering import save_video

FPS = 3


class Habits(NamedTuple):
    """By time step, means over episodes that are still going on."""

    size: int
    steps: int
    n_episodes: int
    value: float
    caught: float
    """Share of prey caught; its standard error is ``(value (1 - value) / n_episodes) ** 0.5``."""
    going: np.ndarray
    """How many episodes were still going on."""
    idling: np.ndarray
    """Share of predators that stand still."""
    even: np.ndarray
    """Share of predators at an even distance from the prey."""
    distance: np.ndarray
    """Mean distance of a predator to the prey, in steps."""
    enclosed: np.ndarray
    """Share of prey that have predators all round: no gap between them is as wide as 180 degrees."""
    exits: np.ndarray
    """Actions of the prey that it takes with a chance of at least a hundredth."""


def watch(size: int, n_episodes: int) -> Habits:
    """Episodes from random starts, one and a half times the size long."""
    solution = _solved(size)
    config, steps = solution.config, solution.config.max_cycles
    episodes = _episodes(solution, n_episodes)
    paths = _paths(episodes)
    far, going = paths.distances[:, :-1, :, 0], np.arange(steps) < paths.lengths[:, None]
    idle = (np.diff(paths.predators, axis=1) == 0).all(axis=3)
    loose = Thresholds(near=size, wait=0, approach=0)
    by_step = (
        idle.mean(axis=2),
        (far % 2 == 0).mean(axis=2),
        far.mean(axis=2),
        BEHAVIOURS["encirclement"].rule(paths, loose)[:, :-1],
        np.array([_exits(episode, solution) for episode in episodes]),
    )
    counts = going.sum(axis=0)
    means = [(each * going).sum(axis=0)[counts > 0] / counts[counts > 0] for each in by_step]
    caught = float(np.mean([episode.worlds[-1].alive.sum() == 0 for episode in episodes]))
    value = by_parity(solution, steps)[0]
    return Habits(config.size, steps, n_episodes, value, caught, counts[counts > 0], *means)


def behaviours(size: int, n_episodes: int) -> dict[str, BehaviourRate]:
    """What the detectors see in it."""
    return count_behaviours(_paths(_episodes(_solved(size), n_episodes)), np.random.default_rng(0), pairings=8)


def animate(size: int, seeds: tuple[int, ...], pictures: Path) -> None:
    """A few games."""
    solution = _solved(size)
    for seed in seeds:
        frames = list(as_pictures(_episode(solution, seed), FPS))
        save_video([*frames, *[frames[-1]] * 2 * FPS], pictures / f"game-{seed}.gif", FPS)


def _solved(size: int) -> Solution:
    return solve(EnvConfig(size=size, n_prey=1, max_cycles=size * 3 // 2), size * 3 // 2)


def _episode(solution: Solution, seed: int) -> Episode:
    return play(OptimalTeam("predators", solution), OptimalTeam("prey", solution), solution.config, seed)


def _episodes(solution: Solution, n: int) -> list[Episode]:
    return [_episode(solution, seed) for seed in tqdm(range(n), unit="episode", mininterval=10)]


def _paths(episodes: list[Episode]) -> Paths:
    env = episodes[0].env
    trace = np.full((len(episodes), env.max_cycles + 1, env.n_agents, 2), -1, np.int32)
    for row, episode in zip(trace, episodes, strict=True):
        row[: len(episode.cells)] = episode.cells
    return Paths.of_trace(trace, env.n_predators, env.size, np.array([episode.caught_at for episode in episodes]))


def _exits(episode: Episode, solution: Solution) -> np.ndarray:
    """From how many actions the prey draws at each step; 0 after the end."""
    steps, prey = solution.config.max_cycles, OptimalTeam("prey", solution)
    found = np.zeros(steps)
    for step, cells in enumerate(episode.cells[:-1]):
        places = cells[:, 0] * solution.config.size + cells[:, 1]
        found[step] = (prey.strategies(places, steps - step)[1] >= 0.01).sum()
    return found
