"""Evaluator of any game of two teams: a parallel PettingZoo environment, played in several processes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from itertools import pairwise, starmap
from typing import Any

import numpy as np

from esp_trainer.cores import cores
from esp_trainer.evaluation.lockstep import Job, JobResult, play_job
from esp_trainer.evaluation.seats import Squad
from esp_trainer.evaluation.starts import SeedStarts
from esp_trainer.evaluation.workers import WorkError, Workers
from esp_trainer.game import Environment, GameConfig, GameError, can_play_many, game_of, in_one_line, make_environment
from esp_trainer.networks.controller import Controller
from esp_trainer.types import (
    ROLES,
    Role,
    TeamBatch,
    TrialBatch,
    TrialResult,
    no_teams,
    zero_sum_part,
)
from predprey_env.arrays import Observation

_JOBS_PER_PROCESS = 4  # so that a process with short episodes takes over jobs from the others
_LEAST_SIDE_BY_SIDE = 512  # episodes in a job, as a step in arrays takes nearly as long for a few of them
_CHECKED_STEPS = 50
_CHECKED_EPISODES = 4


class GameEvaluator:
    """Plays batches of another game. The results do not depend on the number of processes.

    An agent's fitness is its undiscounted return, and no agent counts as captured.

    Args:
        config: The game.
        processes: Number of processes; by default one for each core.

    Raises:
        GameError: The game cannot be played.
    """

    def __init__(self, config: GameConfig, processes: int | None = None) -> None:
        self.config = config
        self.game = game_of(config)
        self.starts = SeedStarts(self.game.shapes["prey"].n_agents)
        self.processes = processes or cores()
        self._workers = Workers(_play, self.processes)

    def compile(self, predators: Controller | None = None, prey: Controller | None = None) -> None:
        """Load or compile the networks of two controllers, or scripts, and play an episode twice.

        Raises :class:`GameError` unless both episodes are equal: otherwise results would depend on which process plays
        which episode.
        """
        with in_one_line(self.config.environment, "in an episode of random actions"):
            check_repeats(self.config)
        shapes = self.game.shapes
        teams = no_teams(predators, shapes["predators"].n_agents), no_teams(prey, shapes["prey"].n_agents)
        self.evaluate(TrialBatch(*teams, np.zeros((0, 1), np.int64)))

    def evaluate(self, batch: TrialBatch) -> TrialResult:
        """Play every episode of every trial. Raises :class:`GameError` if the environment fails."""
        seeds = np.require(batch.starts, np.int64)
        teams: dict[Role, TeamBatch] = {"predators": batch.predators, "prey": batch.prey}
        squads = {role: Squad.of(role, teams[role], len(seeds), self.game.shapes[role]) for role in ROLES}
        n_parts = min(len(seeds), 1 if self.processes == 1 else _JOBS_PER_PROCESS * self.processes)
        if self.game.has_many:
            n_parts = min(n_parts, seeds.size // _LEAST_SIDE_BY_SIDE)
        bounds = np.linspace(0, len(seeds), max(1, n_parts) + 1).astype(int).tolist()
        parts = list(starmap(slice, pairwise(bounds)))
        jobs = [
            (self.config.model_dump_json(), Job({r: s.part(p) for r, s in squads.items()}, seeds[p])) for p in parts
        ]
        if len(jobs) == 1:
            outcomes = [_play(jobs[0])]
        else:
            try:
                outcomes = self._workers.map(jobs)
            except WorkError as error:
                raise GameError(str(error)) from None
        fitness, steps = (np.concatenate(arrays) for arrays in zip(*outcomes, strict=True))
        n_predators, n_prey = (self.game.shapes[role].n_agents for role in ROLES)
        nobody = np.zeros((*steps.shape, n_prey), np.bool_)
        return TrialResult(fitness, nobody, steps, zero_sum_part(fitness, n_predators))


def _play(job: tuple[str, Job]) -> JobResult:
    """Play a job of a game, in any process."""
    config, episodes = job
    return play_job(game_of(GameConfig.model_validate_json(config)), episodes, _copies(config))


@lru_cache(maxsize=2)
def _copies(config: str) -> Callable[[int], Environment]:
    """Return a function that maps an index to a copy of the environment, which is made when first needed."""
    read = GameConfig.model_validate_json(config)
    made: list[Environment] = []

    def copy(number: int) -> Environment:
        while len(made) <= number:
            made.append(make_environment(read))
        return made[number]

    return copy


def check_repeats(config: GameConfig) -> None:
    """Raise :class:`GameError` unless an episode follows from its seed and the actions alone, in finite numbers.

    The episode is played with random actions in a new environment, in one that has played another episode, and in the
    first one again.
    """
    first, other = make_environment(config), make_environment(config)
    expected = _course(first, 1)
    for name, told in (each for step in expected for each in step.items()):
        if not np.isfinite(told).all():  # nan differs from itself, so it would pass for a game that does not repeat
            raise GameError(f"{config.environment} must give finite numbers, got {told} as {name}")
    _course(other, 2)
    if can_play_many(first):
        _check_many(config, first)
    for env in (other, first):
        if _course(env, 1) != expected:
            raise GameError(
                f"an episode of {config.environment} must follow from its seed and the actions alone, got two that "
                "differ: draw all random numbers from a generator that reset(seed) makes anew"
            )


def _check_many(config: GameConfig, env: Environment) -> None:
    """Raise :class:`GameError` unless episodes played side by side equal those played one at a time."""
    seeds = np.arange(1, 1 + _CHECKED_EPISODES)
    courses = [_course(env, seed) for seed in seeds.tolist()]
    generators = [np.random.default_rng(seed) for seed in seeds.tolist()]
    many, rewards, over = env.many(), dict[str, np.ndarray](), np.zeros(len(seeds), np.bool_)
    observations: Mapping[str, Observation] = many.reset(seeds)
    for step in range(max(map(len, courses))):
        if step:
            drawn = {
                agent: [int(g.integers(env.action_space(agent).n)) for g in generators] for agent in env.possible_agents
            }
            observations, rewards, over = many.step({agent: np.array(actions) for agent, actions in drawn.items()})
        for seed, expected in [(episode, course[step]) for episode, course in enumerate(courses) if step < len(course)]:
            found: dict[str, Any] = {agent: np.asarray(seen[seed]).tolist() for agent, seen in observations.items()}
            found |= {f"reward of {agent}": float(paid[seed]) for agent, paid in rewards.items()}
            found["end"] = bool(over[seed])
            differs = next((name for name, value in expected.items() if found.get(name) != value), None)
            if differs:
                raise GameError(
                    f"many() of {config.environment} must play as the environment does, got another {differs} in step "
                    f"{step} with seed {seeds[seed]}"
                )


def _course(env: Environment, seed: int) -> list[dict[str, Any]]:
    """Return all observations and rewards in the first steps of an episode with random actions."""
    generator = np.random.default_rng(seed)
    observations, _ = env.reset(seed=seed)
    course: list[dict[str, Any]] = [{agent: np.asarray(seen).tolist() for agent, seen in observations.items()}]
    while env.agents and len(course) <= _CHECKED_STEPS:
        actions = {agent: int(generator.integers(env.action_space(agent).n)) for agent in env.agents}
        observations, rewards = _stepped(env, actions)
        course.append({f"reward of {agent}": float(reward) for agent, reward in rewards.items()})
        course[-1]["end"] = not env.agents
        if env.agents:
            course[-1] |= {agent: np.asarray(seen).tolist() for agent, seen in observations.items()}
    return course


def _stepped(env: Environment, actions: dict[str, int]) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
    """Return a step's observations and rewards; raise :class:`GameError` unless it returns what PettingZoo asks for."""
    told, step = env.step(actions), f"step() of {type(env).__name__}"
    if len(told) != 5:
        names = "observations, rewards, terminations, truncations and infos"
        raise GameError(f"{step} must return {names}, got {len(told)} values")
    unpaid = [agent for agent in actions if agent not in told[1]]
    if unpaid:
        raise GameError(f"{step} must return a reward of each agent that acted, got none of {', '.join(unpaid)}")
    return told[0], told[1]
