"""Exact best responses: one side's policy is fixed, the other side's decision process is solved."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from esp_trainer.evaluation.fused import cores
from esp_trainer.exact.solution import Solution, by_parity, means_by_parity
from esp_trainer.exact.states import Moves, moves_of
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
    exploited, exploited_by_even = means_by_parity(values, solution.config)
    return Exploitability(role, horizon, optimal, exploited, optimal_by_even, exploited_by_even)


def best_response(
    chances: np.ndarray,
    role: Role,
    config: EnvConfig,
    horizon: int,
    watch: Callable[[np.ndarray], object] = lambda _: None,
) -> np.ndarray:
    """Chance that the prey is caught in time in every state, when the other side answers a fixed policy optimally.

    Args:
        chances: Of the fixed policy's actions, ``(n_keys, n_agents, n_actions)``.
        role: Which side is fixed.
        config: The world, with one prey.
        horizon: Steps of the episode.
        watch: Called with what would be returned for each shorter episode and for this, the shortest first.

    Returns:
        float64 ``(n_keys,)``; states with a predator in the prey's cell hold 1.
    """
    if config.move_order != "simultaneous":
        raise ValueError(f"best responses are worked out for games of simultaneous moves, got {config.move_order}")
    moves, n_keys = moves_of(config), len(chances)
    later, now = np.zeros(n_keys), np.zeros(n_keys)
    solve = _answer_predators if role == "predators" else _answer_prey

    def part(first: int) -> None:
        cells, scratch = np.zeros(config.n_predators, np.int32), np.zeros((2, config.n_predators, 8), np.int64)
        solve(moves, chances, later, now, first, min(first + _PART, n_keys), cells, scratch)

    with ThreadPoolExecutor(cores()) as pool:
        for _ in range(horizon):
            list(pool.map(part, range(0, n_keys, _PART)))
            later, now = now, later
            watch(later)
    return later


def memory_for_response(config: EnvConfig, role: Role) -> int:
    """Bytes, at most, that :func:`best_response` takes together with the chances that it is given."""
    shape = config.team(role)
    n_keys: int = config.size ** (2 * config.n_predators)
    return 8 * n_keys * (shape.n_agents * (shape.n_actions + shape.n_seen + 2) + 6)


@rule
def _cells_of(key: int, n_cells: int, cells: Any) -> bool:
    """A key's digits; whether the prey is free there."""
    free = True
    for i in range(len(cells) - 1, -1, -1):
        cells[i] = key % n_cells
        key //= n_cells
        free = free and cells[i] != 0
    return free


@rule
def _after(moves: Moves, cells: Any, actions: Any, prey_action: int, later: Any) -> float:
    """The chance of a capture from the state that follows."""
    key, n_cells = 0, moves.cell.shape[0]
    for i in range(len(cells)):
        if moves.caught[cells[i], actions[i], prey_action]:
            return 1.0
        key = key * n_cells + moves.cell[cells[i], actions[i], prey_action]
    return later[key]  # type: ignore[no-any-return]


@entry_point
def _answer_predators(
    moves: Moves, chances: Any, later: Any, now: Any, first: int, last: int, cells: Any, scratch: Any
) -> None:
    """The prey's best: the action after which it is caught least."""
    n_predators, n_cells, n_actions = len(cells), moves.cell.shape[0], moves.cell.shape[1]
    likely, actions, which = scratch[0], scratch[1, :, 0], scratch[1, :, 1]
    for key in range(first, last):
        if not _cells_of(key, n_cells, cells):
            now[key] = 1.0
            continue
        n_joint = 1
        for i in range(n_predators):  # the actions that the predator may take, and how many they are
            n_likely = 0
            for action in range(n_actions):
                if chances[key, i, action] > 0.0:
                    likely[i, n_likely] = action
                    n_likely += 1
            which[i] = n_likely
            n_joint *= n_likely
        least = 2.0
        for prey_action in range(moves.cell.shape[2]):
            total = 0.0
            for joint in range(n_joint):
                digits, chance = joint, 1.0
                for i in range(n_predators):
                    actions[i] = likely[i, digits % which[i]]
                    digits //= which[i]
                    chance *= chances[key, i, actions[i]]
                total += chance * _after(moves, cells, actions, prey_action, later)
            least = min(least, total)
        now[key] = least


@entry_point
def _answer_prey(
    moves: Moves, chances: Any, later: Any, now: Any, first: int, last: int, cells: Any, scratch: Any
) -> None:
    """The predators' best joint action."""
    n_predators, n_cells, n_actions = len(cells), moves.cell.shape[0], moves.cell.shape[1]
    actions = scratch[1, :, 0]
    n_joint = n_actions**n_predators
    for key in range(first, last):
        if not _cells_of(key, n_cells, cells):
            now[key] = 1.0
            continue
        most = 0.0
        for joint in range(n_joint):
            digits = joint
            for i in range(n_predators):
                actions[i] = digits % n_actions
                digits //= n_actions
            total = 0.0
            for prey_action in range(moves.cell.shape[2]):
                chance = chances[key, 0, prey_action]
                if chance > 0.0:
                    total += chance * _after(moves, cells, actions, prey_action, later)
            most = max(most, total)
        now[key] = most
