"""Estimates of the time to ask a policy, to solve a game or to compute a best response, from a sample of positions."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter
from typing import Any

import numpy as np

from esp_trainer.arrays import ActionProbabilities
from esp_trainer.cores import cores
from esp_trainer.exact import response, solution
from esp_trainer.exact.chances import ask_in, views
from esp_trainer.exact.states import states_of, turns_of
from esp_trainer.types import Role
from predprey_env.config import EnvConfig
from predprey_env.policies.opponents import sight_in

_SAMPLE = 1024  # number of positions; they take a few tenths of a second at most if the whole game can be solved at all
_LONG_ENOUGH = 0.1  # shortest time, in seconds, that is measured precisely enough


def seconds_to_solve(config: EnvConfig, horizon: int) -> float:
    """Estimate how many seconds :func:`~esp_trainer.exact.solution.solve` takes on this machine.

    All steps take the same time.
    """
    states = states_of(config.size, config.n_predators, config.n_prey)
    n_states = len(states.cells)
    first, last = _sample(int(states.first[-2]), n_states)
    later, now = np.zeros((2, n_states))
    seconds = 0.0
    for moves in turns_of(config):
        room = solution.make_solution_work(config.n_predators, config.n_prey, moves)
        seconds += _timed(solution.back_up, states, moves, later, now, first, last, room)
    return seconds * horizon * n_states / (last - first) / cores()


def sample_of(policy: Any, role: Role, config: EnvConfig) -> tuple[ActionProbabilities, float]:
    """Return a policy's action probabilities in a sample of positions, ``(n, n_agents, n_actions)``, and an estimate of
    how many seconds :func:`~esp_trainer.exact.chances.chances` takes to ask it in all positions.
    """
    seen, n, before = views(config, role, sight_in(policy, config)), 1, float("inf")
    while True:  # double the sample until it takes long enough: a policy may take a microsecond or a second a position
        part = seen[np.linspace(0, len(seen) - 1, n).astype(int)]
        seconds = _timed(ask_in, policy, part, role, config)
        # A large network takes as long for one position as for a thousand: such a time cannot be extrapolated.
        grows = seconds > 1.5 * before
        if (seconds > _LONG_ENOUGH and grows) or n == min(_SAMPLE, len(seen)):
            return ask_in(policy, part, role, config), seconds * len(seen) / n
        n, before = min(2 * n, _SAMPLE, len(seen)), seconds


def seconds_to_answer(sample: ActionProbabilities, role: Role, config: EnvConfig, horizon: int) -> float:
    """Estimate how many seconds :func:`~esp_trainer.exact.response.best_response` takes on this machine.

    Args:
        sample: Sample of the fixed policy's action probabilities, ``(n, n_agents, n_actions)``.
        role: Side that is fixed.
        config: The world.
        horizon: Number of steps of the longest episode.
    """
    game, keys = response.parts_of(config)[-1]
    first, last = _sample(int(game.begins[-1]), keys.stop)
    later, now = np.zeros(keys.stop), np.zeros(last - first)
    seconds = 0.0
    for moves in turns_of(config):
        moving = response.is_moving(role, moves)
        shape = (last - first, *sample.shape[1:])
        fixed = np.resize(sample, shape) if moving else np.ones((*shape[:2], 1))
        room = response.make_response_work(game, moves, role)
        seconds += _timed(response.best_answers, game, moves, fixed, role == "predators", later, now, first, room)
    return seconds * horizon * int(keys.stop) / (last - first) / cores()


def _sample(first: int, last: int) -> tuple[int, int]:
    """Return the bounds of a sample from the middle of the states; at the beginning agents are close together."""
    middle = (first + last) // 2
    return max(first, middle - _SAMPLE // 2), min(last, middle + _SAMPLE // 2)


def _timed(work: Callable[..., Any], *arguments: Any) -> float:
    work(*arguments)  # compile it and fill the processor's caches before the measurement
    begun = perf_counter()
    work(*arguments)
    return perf_counter() - begun
