"""Values and equilibria of the game, by going back from its end (Shapley 1953)."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from math import factorial
from pathlib import Path
from typing import Any

import numpy as np

from esp_trainer.evaluation.fused import cores
from esp_trainer.evaluation.starts import distances
from esp_trainer.exact.matrix_game import Workspace, equilibrium, make_workspace
from esp_trainer.exact.states import Moves, States, moves_of, states_of
from predprey_env.compilation import entry_point, rule
from predprey_env.config import EnvConfig

_PART = 2048  # states a thread takes at a time


@dataclass(frozen=True)
class Solution:
    """The game of ``n_predators`` against one prey, solved for every number of steps left.

    The predators win 1 if they catch the prey in time, and choose together; the prey wins what they do not.
    """

    config: EnvConfig
    states: States
    moves: Moves
    values: np.ndarray
    """What the predators win under optimal play: float64 ``(horizon + 1, n_states)``, by steps left and state."""

    @property
    def horizon(self) -> int:
        """The longest game that is solved, in steps."""
        return len(self.values) - 1

    def value(self, cells: np.ndarray, steps: int) -> np.ndarray:
        """Of states given by the predators' cells ``(..., n_predators)``, none of them the prey's."""
        return np.asarray(self.values[steps, self.states.number[keys(cells, self.config.size)]])


def keys(cells: np.ndarray, size: int) -> np.ndarray:
    """The places of states among all, from the predators' cells ``(..., n_predators)``."""
    n_predators = cells.shape[-1]
    return np.asarray(cells @ (size**2) ** np.arange(n_predators)[::-1])


def memory_needed(config: EnvConfig, horizon: int) -> int:
    """Bytes, at most, that :func:`solve` takes."""
    n_keys = (config.size**2) ** config.n_predators
    # The number of every key, some 40 keys a state with three predators, and each state's cells and values.
    n_states = n_keys // (8 * factorial(config.n_predators)) + config.size**config.n_predators
    return int(4 * n_keys + n_states * (4 * config.n_predators + 8 * (horizon + 1)))


def check_memory(n_bytes: int) -> None:
    """Raise :class:`MemoryError` with the figure if so much is not free, where the system tells."""
    facts = Path("/proc/meminfo")
    if facts.exists():
        kilobytes = next(line.split()[1] for line in facts.read_text().splitlines() if line.startswith("MemAvailable"))
        if n_bytes > 1024 * int(kilobytes):
            raise MemoryError(f"{n_bytes / 1e9:,.1f} GB are needed, {1024 * int(kilobytes) / 1e9:,.1f} are free")


def solve(
    config: EnvConfig, horizon: int, watch: Callable[[int], object] = lambda _: None, threads: int | None = None
) -> Solution:
    """Solve the game of a world with one prey.

    Args:
        config: The world; its time limit does not matter.
        horizon: For up to so many steps left.
        watch: Called with the number of steps left that has been solved.
        threads: How many to use; by default one for each core.

    Raises:
        MemoryError: More is needed than is free.
        ValueError: There is more than one prey.
    """
    if config.n_prey != 1:
        raise ValueError(f"only games with one prey can be solved, got {config.n_prey}")
    check_memory(memory_needed(config, horizon))
    states, moves = states_of(config.size, config.n_predators), moves_of(config)
    values = np.zeros((horizon + 1, len(states.cells)))
    n_joint = config.n_predator_actions**config.n_predators
    turns = config.move_order == "prey_first"

    def part(steps: int, first: int) -> None:
        work = make_workspace(n_joint, config.n_prey_actions)
        last = min(first + _PART, len(states.cells))
        _back_up(states, moves, values[steps - 1], values[steps], first, last, turns, work)

    with ThreadPoolExecutor(threads or cores()) as pool:
        for steps in range(1, horizon + 1):
            list(pool.map(part, [steps] * len(states.cells), range(0, len(states.cells), _PART)))
            if np.isnan(values[steps]).any():
                raise ArithmeticError(f"no equilibrium was found of {np.isnan(values[steps]).sum()} positions")
            watch(steps)
    return Solution(config, states, moves, values)


@entry_point
def _back_up(
    states: States, moves: Moves, later: Any, now: Any, first: int, last: int, turns: bool, work: Workspace
) -> None:
    """The values of some states, from those with one step less."""
    for state in range(first, last):
        fill_payoffs(states.cells[state], states, moves, later, work)
        now[state] = best_answer(work.payoffs) if turns else equilibrium(work)


@rule
def fill_payoffs(cells: Any, states: States, moves: Moves, later: Any, work: Workspace) -> None:
    """The matrix game of one state: what predators win by their joint action, whose digits are theirs, the first
    predator's the highest, and by the prey's.
    """
    n_predators, n_cells = len(cells), moves.cell.shape[0]
    n_actions, n_prey_actions = moves.cell.shape[1:]
    for joint in range(work.payoffs.shape[0]):
        for prey_action in range(n_prey_actions):
            digits, place, key, caught = joint, 1, 0, False
            for i in range(n_predators):
                predator = n_predators - 1 - i
                action = digits % n_actions
                digits //= n_actions
                caught |= moves.caught[cells[predator], action, prey_action]
                key += place * moves.cell[cells[predator], action, prey_action]
                place *= n_cells
            work.payoffs[joint, prey_action] = 1.0 if caught else later[states.number[key]]


@rule
def best_answer(payoffs: Any) -> float:
    """The value where the prey moves first and is seen: the least over its actions of the most over the predators'."""
    value = 2.0
    for column in range(payoffs.shape[1]):
        most = 0.0
        for row in range(payoffs.shape[0]):
            most = max(most, payoffs[row, column])
        value = min(value, most)
    return value


def by_parity(solution: Solution, steps: int) -> tuple[float, list[float]]:
    """Mean value over all starts, and over those with 0, 1, 2, ... predators at an even distance from the prey."""
    number = solution.states.number
    values = np.where(number < 0, 1.0, solution.values[steps, number])
    return means_by_parity(values, solution.config)


def means_by_parity(values: np.ndarray, config: EnvConfig) -> tuple[float, list[float]]:
    """Means of a number for each key ``(n_keys,)`` over all starts, and by how many predators are at an even distance.

    A start has no predator in the prey's cell; all starts count alike. (The environment places the prey last, so that
    there starts in which predators share a cell are a little rarer.)
    """
    size, n_predators = config.size, config.n_predators
    alone = np.zeros((size**2, 2, 2), np.int64)  # a predator in each cell, and the prey in the first
    alone[:, 0] = np.stack(np.divmod(np.arange(size**2), size), axis=1)
    far = distances(alone, config.replace(n_predators=1)).ravel()
    even, free = far % 2 == 0, far > 0
    counts, starts = np.zeros(1, int), np.ones(1, bool)
    for _ in range(n_predators):
        counts = (counts[:, None] + even).ravel()
        starts = (starts[:, None] & free).ravel()
    counts, values = counts[starts], values[starts]
    return float(values.mean()), [float(values[counts == n].mean()) for n in range(n_predators + 1)]
