"""Exact best responses: the policy of one side is fixed, and the other side's Markov decision process is solved."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from math import comb
from typing import Any, NamedTuple

import numpy as np

from esp_trainer.arrays import ActionProbabilities, StateValues
from esp_trainer.cores import cores
from esp_trainer.exact.chances import chances as chances_of
from esp_trainer.exact.chances import survivors
from esp_trainer.exact.parity import by_parity, means_by_parity
from esp_trainer.exact.solution import Solution, after_turn, assign, joint_actions, look_round
from esp_trainer.exact.states import Moves, n_keys, read_key, turns_of
from esp_trainer.types import Role
from predprey_env.config import EnvConfig
from predprey_env.jit.compilation import entry_point, rule

_PART = 4096  # number of states that a thread takes at a time


@dataclass(frozen=True)
class Exploitability:
    """Loss of a policy against its worst opponent, compared with optimal play."""

    role: Role
    horizon: int
    """Number of steps of an episode."""
    optimal: float
    """Fraction of prey caught over all starts if both sides play optimally."""
    exploited: float
    """Fraction of prey caught over all starts if the policy meets its best response."""
    optimal_by_even: list[float]
    """``optimal`` by the number of predators that start at an even distance."""
    exploited_by_even: list[float]

    @property
    def loss(self) -> float:
        """Fraction of prey that the policy loses compared with optimal play: 0 if it plays optimally."""
        return self.optimal - self.exploited if self.role == "predators" else self.exploited - self.optimal


def exploitability(chances: ActionProbabilities, role: Role, solution: Solution, horizon: int) -> Exploitability:
    """Compute the exploitability of a policy from its action probabilities in every state.

    ``chances`` are those that :func:`esp_trainer.exact.chances.chances` returns.
    """
    return exploitability_from(best_response(chances, role, solution.config, horizon), role, solution, horizon)


def exploitability_of(policy: Any, role: Role, solution: Solution) -> Exploitability:
    """Compute the exploitability of a policy in the world and for the horizon of a solution.

    The policy follows the policy protocol and the conditions of :func:`esp_trainer.exact.chances.chances`.
    """
    return exploitability(chances_of(policy, role, solution.config), role, solution, solution.horizon)


def exploitability_from(values: StateValues, role: Role, solution: Solution, horizon: int) -> Exploitability:
    """Compute the exploitability of a policy from the values of its best response, as :func:`best_response` returns
    them.
    """
    optimal, optimal_by_even = by_parity(solution, horizon)
    exploited, exploited_by_even = means_by_parity(values, solution)
    return Exploitability(role, horizon, optimal, exploited, optimal_by_even, exploited_by_even)


def best_response(chances: ActionProbabilities, role: Role, config: EnvConfig, horizon: int) -> StateValues:
    """Return the number of prey caught in an episode of ``horizon`` steps against a best response; see
    :func:`best_responses`.
    """
    *_, values = best_responses(chances, role, config, horizon)
    return values


def best_responses(chances: ActionProbabilities, role: Role, config: EnvConfig, horizon: int) -> Iterator[StateValues]:
    """Yield the number of prey caught in time when the other side plays a best response to a fixed policy.

    The first value is for an episode of one step, the second for an episode of two, and so on.

    Args:
        chances: Action probabilities of the fixed policy, ``(n_states, n_agents, n_actions)``.
        role: Side that is fixed.
        config: The world.
        horizon: Number of steps of the longest episode.

    Yields:
        float64 ``(n_keys,)``: the value of every state with all prey free. Values of states with a predator in a prey's
            cell mean nothing.
    """
    turns, parts = turns_of(config), parts_of(config)
    later, now = np.zeros((2, len(chances)))
    # A side that does not move in a turn has a single action, with probability 1.
    still = np.ones((*chances.shape[:2], 1)) if len(turns) > 1 else chances
    with ThreadPoolExecutor(cores()) as pool:
        for _ in range(horizon):
            for moves in reversed(turns):
                fixed = chances if is_moving(role, moves) else still

                def answer(
                    part: tuple[Subgame, slice],
                    moves: Moves = moves,
                    fixed: ActionProbabilities = fixed,
                    later: StateValues = later,
                    now: StateValues = now,
                ) -> None:
                    game, keys = part
                    room = make_response_work(game, moves, role)
                    best_answers(game, moves, fixed[keys], role == "predators", later, now[keys], keys.start, room)

                list(pool.map(answer, parts))
                later, now = now, later
            yield later[survivors(config)[-1].keys].copy()


def is_moving(role: Role, moves: Moves) -> bool:
    """Return whether a side moves in this turn; if not, it has a single action."""
    return bool(moves.cell.shape[1 if role == "predators" else 2] > 1)


class Subgame(NamedTuple):
    """The part of the game in which a given subset of the prey is left."""

    n_predators: int
    prey: Any
    """Indices of the prey that are left: int64 ``(n_prey,)``."""
    begins: Any
    """Index of the first state in which a subset of ``prey`` is free, by the subset's bits: int64 ``(2 **
    n_prey,)``."""


def parts_of(config: EnvConfig) -> list[tuple[Subgame, slice]]:
    """Return all states, in portions with the same prey left."""
    found, games = [], survivors(config)
    for prey, keys in games:
        begins = np.zeros(2 ** len(prey), np.int64)
        for others, theirs in games:
            if set(others) <= set(prey):
                begins[sum(1 << prey.index(each) for each in others)] = theirs.start
        game = Subgame(config.n_predators, np.array(prey), begins)
        found += [(game, slice(first, min(first + _PART, keys.stop))) for first in range(keys.start, keys.stop, _PART)]
    return found


class ResponseWork(NamedTuple):
    """Scratch arrays for one thread's best responses."""

    cells: Any
    seen: Any
    actions: Any
    fixed: Any
    """Joint actions of the fixed side."""
    answers: Any
    """Joint actions of the other side."""
    totals: Any
    """Expected number of prey caught after each answer: float64 ``(n_joint,)``."""


def make_response_work(game: Subgame, moves: Moves, role: Role) -> ResponseWork:
    """Return scratch arrays for a turn; each thread needs its own."""
    n_prey = len(game.prey)
    n_agents = game.n_predators + n_prey
    joints, flights = joint_actions(moves, game.n_predators, n_prey)
    fixed, answers = (joints, flights) if role == "predators" else (flights, joints)
    cells, seen, actions = (np.zeros(shape, np.int64) for shape in ((n_agents,), (n_prey, n_agents), (n_agents,)))
    return ResponseWork(cells, seen, actions, fixed, answers, np.zeros(len(answers)))


def memory_for_response(config: EnvConfig, role: Role) -> int:
    """Return the largest number of bytes that :func:`best_response` takes, including the probabilities that it is
    given.
    """
    shape = config.team(role)
    games = range(1, config.n_prey + 1)
    n_states = sum(comb(config.n_prey, n) * n_keys(config.size, config.n_predators, n) for n in games)
    return 8 * n_states * (shape.n_agents * (4 * shape.n_actions + shape.n_seen) + 6)


@entry_point
def best_answers(
    game: Subgame,
    moves: Moves,
    chances: Any,
    predators_fixed: bool,
    later: Any,
    now: Any,
    first: int,
    room: ResponseWork,
) -> None:
    """Compute the values of a best response in the states from ``first`` on, and write them to ``now``.

    The response minimises the number of prey caught if the predators are fixed, and maximises it if the prey are.
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
            weight = _joint_probability(game, chances[state], predators_fixed, room.fixed[joint])
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
def _joint_probability(game: Subgame, chances: Any, predators_fixed: bool, joint: Any) -> float:
    """Return the probability of a joint action of the fixed side."""
    probability = 1.0
    for i in range(len(joint)):
        probability *= chances[i if predators_fixed else game.prey[i], joint[i]]
        if probability == 0.0:
            break
    return probability
