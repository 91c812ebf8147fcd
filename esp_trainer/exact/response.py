"""Exact best responses: one side's policy is fixed, the other side's decision process is solved."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from math import comb
from typing import Any, NamedTuple

import numpy as np

from esp_trainer.cores import cores
from esp_trainer.exact.chances import survivors
from esp_trainer.exact.solution import (
    Solution,
    after_turn,
    assign,
    by_parity,
    joint_actions,
    look_round,
    means_by_parity,
)
from esp_trainer.exact.states import Moves, n_keys, read_key, turns_of
from esp_trainer.types import Role
from predprey_env.compilation import entry_point, rule
from predprey_env.config import EnvConfig

_PART = 4096  # states a thread takes at a time


@dataclass(frozen=True)
class Exploitability:
    """How much a policy loses against its worst opponent, beside optimal play."""

    role: Role
    horizon: int
    """Steps of an episode."""
    optimal: float
    """Share of prey caught when both sides play optimally, over all starts."""
    exploited: float
    """When the policy meets the best response to it."""
    optimal_by_even: list[float]
    """By how many predators start at an even distance."""
    exploited_by_even: list[float]

    @property
    def loss(self) -> float:
        """What the policy loses: 0 for optimal play."""
        return self.optimal - self.exploited if self.role == "predators" else self.exploited - self.optimal


def exploitability(chances: np.ndarray, role: Role, solution: Solution, horizon: int) -> Exploitability:
    """Of a policy by its action chances in every state (:func:`esp_trainer.exact.chances.chances`)."""
    return measured(best_response(chances, role, solution.config, horizon), role, solution, horizon)


def measured(values: np.ndarray, role: Role, solution: Solution, horizon: int) -> Exploitability:
    """From what a policy's best response takes of it, as :func:`best_response` returns it."""
    optimal, optimal_by_even = by_parity(solution, horizon)
    exploited, exploited_by_even = means_by_parity(values, solution)
    return Exploitability(role, horizon, optimal, exploited, optimal_by_even, exploited_by_even)


def best_response(chances: np.ndarray, role: Role, config: EnvConfig, horizon: int) -> np.ndarray:
    """How many prey are caught in an episode of ``horizon`` steps; see :func:`best_responses`."""
    *_, values = best_responses(chances, role, config, horizon)
    return values


def best_responses(chances: np.ndarray, role: Role, config: EnvConfig, horizon: int) -> Iterator[np.ndarray]:
    """How many prey are caught in time from every state in which all are free, when the other side answers a fixed
    policy optimally: for an episode of one step, of two, and so on.

    Args:
        chances: Of the fixed policy's actions, ``(n_states, n_agents, n_actions)``.
        role: Which side is fixed.
        config: The world.
        horizon: Steps of the longest episode.

    Yields:
        float64 ``(n_keys,)``. What states with a predator in a prey's cell hold means nothing.
    """
    turns, parts = turns_of(config), parts_of(config)
    later, now = np.zeros((2, len(chances)))
    still = np.ones((*chances.shape[:2], 1)) if len(turns) > 1 else chances  # of who does not move in a turn
    with ThreadPoolExecutor(cores()) as pool:
        for _ in range(horizon):
            for moves in reversed(turns):
                fixed = chances if is_moving(role, moves) else still

                def answer(
                    part: tuple[Game, slice],
                    moves: Moves = moves,
                    fixed: np.ndarray = fixed,
                    later: np.ndarray = later,
                    now: np.ndarray = now,
                ) -> None:
                    game, keys = part
                    room = make_room(game, moves, role)
                    best_answers(game, moves, fixed[keys], role == "predators", later, now[keys], keys.start, room)

                list(pool.map(answer, parts))
                later, now = now, later
            yield later[survivors(config)[-1].keys].copy()


def is_moving(role: Role, moves: Moves) -> bool:
    """Return whether a side moves in this turn; if not, it has a single action."""
    return bool(moves.cell.shape[1 if role == "predators" else 2] > 1)


class Game(NamedTuple):
    """The part of the game in which certain prey are left."""

    n_predators: int
    prey: Any
    """Who: int64 ``(n_prey,)``."""
    begins: Any
    """Where the states begin in which some of them are free, by the bits that say which: int64 ``(2 ** n_prey,)``."""


def parts_of(config: EnvConfig) -> list[tuple[Game, slice]]:
    """All states, in portions with the same prey left."""
    found, games = [], survivors(config)
    for prey, keys in games:
        begins = np.zeros(2 ** len(prey), np.int64)
        for others, theirs in games:
            if set(others) <= set(prey):
                begins[sum(1 << prey.index(each) for each in others)] = theirs.start
        game = Game(config.n_predators, np.array(prey), begins)
        found += [(game, slice(first, min(first + _PART, keys.stop))) for first in range(keys.start, keys.stop, _PART)]
    return found


class Room(NamedTuple):
    """Scratch arrays for one thread's best responses."""

    cells: Any
    seen: Any
    actions: Any
    fixed: Any
    """The fixed side's joint actions."""
    answers: Any
    """The other's."""
    totals: Any
    """What the latter lead to: float64 ``(n_joint,)``."""


def make_room(game: Game, moves: Moves, role: Role) -> Room:
    """Each thread needs its own."""
    n_prey = len(game.prey)
    n_agents = game.n_predators + n_prey
    joints, flights = joint_actions(moves, game.n_predators, n_prey)
    fixed, answers = (joints, flights) if role == "predators" else (flights, joints)
    cells, seen, actions = (np.zeros(shape, np.int64) for shape in ((n_agents,), (n_prey, n_agents), (n_agents,)))
    return Room(cells, seen, actions, fixed, answers, np.zeros(len(answers)))


def memory_for_response(config: EnvConfig, role: Role) -> int:
    """Bytes, at most, that :func:`best_response` takes together with the chances that it is given."""
    shape = config.team(role)
    games = range(1, config.n_prey + 1)
    n_states = sum(comb(config.n_prey, n) * n_keys(config.size, config.n_predators, n) for n in games)
    return 8 * n_states * (shape.n_agents * (4 * shape.n_actions + shape.n_seen) + 6)


@entry_point
def best_answers(
    game: Game, moves: Moves, chances: Any, predators_fixed: bool, later: Any, now: Any, first: int, room: Room
) -> None:
    """The other side's best in the states from ``first`` on: the joint action after which fewest prey are caught, or
    most.
    """
    n_predators, n_prey = game.n_predators, len(game.prey)
    first_fixed, first_answer = (0, n_predators) if predators_fixed else (n_predators, 0)
    first_key = first - game.begins[-1]
    for state in range(len(now)):
        if not read_key(first_key + state, moves.size * moves.size, n_predators, room.cells):
            continue
        look_round(room.cells, moves.size, room.seen)
        room.totals[:] = 0.0
        for joint in range(len(room.fixed)):
            weight = _chance(game, chances[state], predators_fixed, room.fixed[joint])
            if weight == 0.0:
                continue
            assign(room.fixed[joint], room.actions, first_fixed)
            for answer in range(len(room.answers)):
                assign(room.answers[answer], room.actions, first_answer)
                left, free, after = after_turn(room.seen, room.actions, moves)
                more = later[game.begins[free] + after] if left > 0 else 0.0
                room.totals[answer] += weight * (n_prey - left + more)
        best = room.totals[0]
        for total in room.totals:
            best = min(best, total) if predators_fixed else max(best, total)
        now[state] = best


@rule
def _chance(game: Game, chances: Any, predators_fixed: bool, joint: Any) -> float:
    """Of a joint action of the fixed side."""
    chance = 1.0
    for i in range(len(joint)):
        chance *= chances[i if predators_fixed else game.prey[i], joint[i]]
        if chance == 0.0:
            break
    return chance
