"""Episodes of any game in lockstep: copies of its environment step side by side, and a team chooses for all at once.

The environment is Python and takes nearly all of the time; the networks are compiled, and cost a hundredth of it. An
episode depends on its seed and its teams alone, so results do not depend on how many copies there are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from esp_trainer.arrays import EpisodeStarts, Fitness, Steps
from esp_trainer.evaluation.seats import Seats, Squad
from esp_trainer.game import Environment, Game, GameError, ManyEpisodes
from esp_trainer.types import ROLES, Role

COPIES = 32
"""Number of environments that step side by side, at most: enough that calls into compiled code cost nothing."""
MANY = 1024
"""Number of episodes that step side by side in arrays, at most."""
MOST_STEPS = 100_000
"""Longest episode, in steps; a game that does not end within them raises an error."""


Squads: TypeAlias = dict[Role, Squad]


class Job(NamedTuple):
    """Episodes to play: all of some trials."""

    squads: Squads
    seeds: EpisodeStarts
    """Seed of each episode, int64 ``(n_trials, n_episodes)``."""


class JobResult(NamedTuple):
    """The results of a job."""

    fitness: Fitness
    """Undiscounted return of each agent, predators first, float64 ``(n_trials, n_episodes, n_agents)``."""
    steps: Steps
    """Calls of ``step`` in each episode, int64 ``(n_trials, n_episodes)``."""


def play_job(game: Game, job: Job, environment: Callable[[int], Environment], copies: int = COPIES) -> JobResult:
    """Play all episodes of a job.

    Args:
        game: The game.
        job: The episodes.
        environment: Function that returns the copy of the environment with an index, the same one each time.
        copies: Number of copies that step side by side, at most.

    Raises:
        GameError: The environment failed.
    """
    n_trials, n_episodes = job.seeds.shape
    if game.has_many:
        many = environment(0).many()
        parts = [slice(first, first + MANY) for first in range(0, max(1, job.seeds.size), MANY)]
        outcomes = [_play_many(game, job, many, part) for part in parts]
        fitness, steps = (np.concatenate(arrays) for arrays in zip(*outcomes, strict=True))
        return JobResult(fitness.reshape(n_trials, n_episodes, fitness.shape[1]), steps.reshape(n_trials, n_episodes))
    copies = min(copies, max(1, job.seeds.size))
    sides = [Seats(role, job.squads[role], game.agents[role], game.shapes[role], copies) for role in ROLES]
    everybody = [name for side in sides for name in side.names]
    outcome = JobResult(np.zeros((n_trials, n_episodes, len(everybody))), np.zeros((n_trials, n_episodes), np.int64))
    for side in sides:
        side.choose()  # loads the compiled code, also where there is no episode
    waiting: Iterator[tuple[int, ...]] = np.ndindex(n_trials, n_episodes)
    running = {copy: at for copy in range(copies) if (at := _begin(game, job, sides, environment(copy), copy, waiting))}
    while running:
        for side in sides:
            side.choose()
        for copy, at in list(running.items()):
            env = environment(copy)
            with _naming(game, "step", job.seeds[at], outcome.steps[at]):
                observations, rewards, *_ = env.step({**sides[0].actions(copy), **sides[1].actions(copy)})
                outcome.fitness[at] += [rewards.get(agent, 0.0) for agent in everybody]
                outcome.steps[at] += 1
                if outcome.steps[at] >= MOST_STEPS:
                    raise GameError(f"an episode must end within {MOST_STEPS} steps")
                if env.agents:
                    for side in sides:
                        side.look(copy, observations, env.agents)
                    continue
            following = _begin(game, job, sides, env, copy, waiting)
            if following:
                running[copy] = following
            else:
                del running[copy]
    return outcome


def _play_many(game: Game, job: Job, many: ManyEpisodes, part: slice) -> JobResult:
    """Play a part of a job's episodes, in their order, all side by side."""
    seeds = job.seeds.ravel()[part]
    trials = np.repeat(np.arange(len(job.seeds)), job.seeds.shape[1])[part]
    sides = [Seats(role, job.squads[role], game.agents[role], game.shapes[role], len(seeds)) for role in ROLES]
    everybody = [name for side in sides for name in side.names]
    outcome = JobResult(np.zeros((len(seeds), len(everybody))), np.zeros(len(seeds), np.int64))
    playing = np.ones(len(seeds), np.bool_)
    for side in sides:
        for copy, (trial, seed) in enumerate(zip(trials.tolist(), seeds.tolist(), strict=True)):
            side.begin(copy, trial, seed)
        side.choose()  # loads the compiled code, also where there is no episode
    if not len(seeds):
        return outcome
    with _naming(game, "many().reset", int(seeds[0])):
        observations = many.reset(seeds)
        for side in sides:
            side.look_at_all(observations, playing)
    while playing.any():
        step = int(outcome.steps.max())
        with _naming(game, "many().step", int(seeds[0]), step):
            if step >= MOST_STEPS:
                raise GameError(f"an episode must end within {MOST_STEPS} steps")
            for side in sides:
                side.choose()
            observations, rewards, over = many.step({**sides[0].actions_of_all(), **sides[1].actions_of_all()})
            paid = np.stack([np.broadcast_to(rewards[agent], len(seeds)) for agent in everybody], axis=1)
            outcome.fitness[playing] += paid[playing]
            outcome.steps[playing] += 1
            playing &= ~np.broadcast_to(np.asarray(over, bool), len(seeds))
            for side in sides:
                side.look_at_all(observations, playing)
    return outcome


def _begin(
    game: Game, job: Job, sides: Sequence[Seats], env: Environment, copy: int, waiting: Iterator[tuple[int, ...]]
) -> tuple[int, ...] | None:
    """Begin the next waiting episode in a copy, and return its trial and episode; None if none is waiting."""
    for at in waiting:
        seed = int(job.seeds[at])
        with _naming(game, "reset", seed):
            observations, _ = env.reset(seed=seed)
            for side in sides:
                side.begin(copy, at[0], seed)
                side.look(copy, observations, env.agents)
            if env.agents:
                return at
    for side in sides:
        side.leave(copy)
    return None


class _naming:  # noqa: N801 - used like a function; a generator would cost as much as the networks do
    """Turn an error of the environment into one line that says where it was raised."""

    def __init__(self, game: Game, call: str, seed: int, step: int | None = None) -> None:
        self._where = game, call, seed, step

    def __enter__(self) -> None: ...

    def __exit__(self, _kind: object, error: BaseException | None, _trace: object) -> None:
        if isinstance(error, Exception):
            game, call, seed, step = self._where
            what = str(error) if isinstance(error, GameError) else f"{type(error).__name__}: {error}"
            when = f"with seed {seed}" if step is None else f"with seed {seed}, after {step} steps"
            raise GameError(f"{game.name} failed in {call}() {when}: {what}") from error
