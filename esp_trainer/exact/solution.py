"""Values and equilibria of the game, by backward induction from its end (Shapley 1953)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from esp_trainer.arrays import Counts, StateValues
from esp_trainer.cores import cores
from esp_trainer.evaluation.starts import distances
from esp_trainer.exact.matrix_game import Workspace, equilibrium, make_workspace
from esp_trainer.exact.states import Moves, States, about_n_states, n_keys, seen_from, states_of, turns_of
from esp_trainer.files import DamagedFileError, read_arrays, write_arrays
from predprey_env.arrays import Actions
from predprey_env.config import PAYOFF, SIGHT, EnvConfig
from predprey_env.jit.compilation import entry_point, rule
from predprey_env.settings import PartError

_MAY_DIFFER = {*PAYOFF, *SIGHT, "max_cycles", "start_collisions", "captured_prey"}
_PART = 1024  # number of states that a thread takes at a time
_CHUNK = 1 << 16  # number of keys that are counted at a time
_COUNTABLE = 10**18  # number of bytes above which an error says only "more than"


@dataclass(frozen=True)
class Solution:
    """The game of a world, solved for every number of steps left.

    The payoff of the predators is the number of prey that they catch in time; the prey lose the same number. Each team
    chooses its actions jointly.
    """

    config: EnvConfig
    states: States = field(repr=False)
    turns: tuple[Moves, ...] = field(repr=False)
    """Turns of a time step: one, or two if the prey move first."""
    values: StateValues = field(repr=False)
    """Number of prey that the predators catch under optimal play, by turns left and state: float64 ``(horizon *
    len(turns) + 1, n_states)``."""

    @property
    def horizon(self) -> int:
        """Length of the longest solved game, in steps."""
        return (len(self.values) - 1) // len(self.turns)

    @cached_property
    def weights(self) -> np.ndarray:
        """Number of starts that each state with all prey free represents: float64, one for each of these states."""
        first, number = self.states.first[-2], self.number
        found = np.zeros(len(self.states.cells) - first)
        for begin in range(0, len(number), _CHUNK):
            part = number[begin : begin + _CHUNK]
            found += np.bincount(part[part >= 0] - first, minlength=len(found))
        return found

    @cached_property
    def even(self) -> Counts:
        """Number of predator-prey pairs at an even distance in each state with all prey free: int, one for each of
        these states.
        """
        cells = self.states.cells[self.states.first[-2] :]
        far = distances(np.stack(np.divmod(cells, self.config.size), axis=-1), self.config)
        return (far % 2 == 0).sum(axis=(1, 2))

    @property
    def number(self) -> np.ndarray:
        """Representative state of each key with all prey free."""
        return self.states.number[self.states.first_key[-2] :]

    def plays(self, env: EnvConfig) -> bool:
        """Return whether a world has the same moves as the solved one.

        Its payoff, its time limit, its starts and the fate of captured prey may differ.
        """
        ours, theirs = (config.model_dump(exclude=_MAY_DIFFER) for config in (self.config, env))
        return ours == theirs

    def value(self, cells: np.ndarray, steps: int) -> StateValues:
        """Return the number of prey caught from states in which all prey are free, with ``steps`` steps left.

        ``cells`` are the cells ``size * x + y`` of all agents, int ``(..., n_agents)``; no predator is in a prey's
        cell.
        """
        size, first = self.config.size, self.config.n_predators
        x, y = np.divmod(cells, size)
        seen = (x - x[..., first, None]) % size * size + (y - y[..., first, None]) % size
        keys = np.delete(seen, first, axis=-1) @ (size**2) ** np.arange(self.config.n_agents - 1)[::-1]
        return self.values[steps * len(self.turns), self.number[keys]]

    def save(self, path: Path | str) -> None:
        """Write the values to a file; everything else follows from the world."""
        write_arrays(Path(path), "solved game", {"env": self.config.model_dump()}, {"values": self.values})

    @classmethod
    def load(cls, path: Path | str) -> Solution:
        """Read a file that :meth:`save` wrote.

        Raises :class:`~esp_trainer.files.DamagedFileError` for any other file, and
        :class:`~predprey_env.settings.PartError` if its world names an observation that cannot be used here.
        """
        header, arrays = read_arrays(Path(path), "solved game")
        try:
            config, values = EnvConfig.from_dict(header["env"]), arrays["values"]
        except PartError as error:
            raise PartError(f"{path}: {error}") from None
        except (KeyError, ValueError) as error:
            raise DamagedFileError(f"{path} is damaged: {error}") from None
        check_memory(memory_needed(config, 0))
        states = states_of(config.size, config.n_predators, config.n_prey)
        if values.ndim != 2 or values.shape[1] != len(states.cells):
            expected = f"(turns, {len(states.cells)})"
            raise DamagedFileError(f"{path} is damaged: its values must have shape {expected}, got {values.shape}")
        return cls(config, states, turns_of(config), values)


def memory_needed(config: EnvConfig, horizon: int) -> int:
    """Return the number of bytes that :func:`solve` takes, at most or nearly so."""
    size, n_predators = config.size, config.n_predators
    n_turns = horizon * (2 if config.move_order == "prey_first" else 1)
    # Values and cells of a state, and scratch memory for its distances.
    a_state = 8 * (n_turns + 1) + 8 * config.n_agents + 64 * config.n_predators * config.n_prey
    games = range(1, config.n_prey + 1)
    return sum(4 * n_keys(size, n_predators, n) + a_state * about_n_states(size, n_predators, n) for n in games)


def check_memory(n_bytes: int) -> None:
    """Raise :class:`MemoryError` with the figures if ``n_bytes`` are not free, where the system reports free memory."""
    facts = Path("/proc/meminfo")
    if facts.exists():
        kilobytes = next(line.split()[1] for line in facts.read_text().splitlines() if line.startswith("MemAvailable"))
        if n_bytes > 1024 * int(kilobytes):
            needed = f"{n_bytes / 1e9:,.1f}" if n_bytes < _COUNTABLE else f"more than {_COUNTABLE / 1e9:,.0f}"
            raise MemoryError(f"{needed} GB are needed, {1024 * int(kilobytes) / 1e9:,.1f} are free")


def solve(
    config: EnvConfig, horizon: int, watch: Callable[[float], object] = lambda _: None, threads: int | None = None
) -> Solution:
    """Solve the game of a world.

    Args:
        config: The world; its time limit does not matter.
        horizon: Largest number of steps left.
        watch: Called now and then with the fraction of the positions that are solved.
        threads: Number of threads; by default one for each core.

    Raises:
        MemoryError: More memory is needed than is free.
        ArithmeticError: Rounding errors left positions without an equilibrium.
    """
    check_memory(memory_needed(config, horizon))
    states, turns = states_of(config.size, config.n_predators, config.n_prey), turns_of(config)
    values = np.zeros((horizon * len(turns) + 1, len(states.cells)))
    parts = list(_parts(states))
    with ThreadPoolExecutor(threads or cores()) as pool:
        for left in range(1, len(values)):
            moves, later, now = turns[-left % len(turns)], values[left - 1], values[left]

            def solve_part(part: range, moves: Moves = moves, later: Any = later, now: Any = now) -> int:
                n_prey = int(np.searchsorted(states.first, part.start, side="right"))
                back_up(
                    states,
                    moves,
                    later,
                    now,
                    part.start,
                    part.stop,
                    make_solution_work(config.n_predators, n_prey, moves),
                )
                return len(part)

            done = (left - 1) * len(states.cells)
            for part in pool.map(solve_part, parts):
                done += part
                watch(done / (len(states.cells) * (len(values) - 1)))
            if np.isnan(now).any():
                raise ArithmeticError(f"no equilibrium was found for {np.isnan(now).sum()} positions")
    return Solution(config, states, turns, values)


def _parts(states: States) -> Iterator[range]:
    """Yield the states in portions with the same number of prey left."""
    for first, last in zip(states.first[:-1].tolist(), states.first[1:].tolist(), strict=True):
        for begin in range(first, last, _PART):
            yield range(begin, min(begin + _PART, last))


class SolutionWork(NamedTuple):
    """Scratch arrays for solving the game of a position with a given number of prey left."""

    work: Workspace
    seen: Any
    """Cell of every agent, seen from each prey: int64 ``(n_prey, n_agents)``."""
    actions: Any
    """Action of every agent: int64 ``(n_agents,)``."""
    joints: Any
    """Joint actions of the predators; see :func:`joint_actions`."""
    flights: Any
    """Joint actions of the prey."""


def joint_actions(moves: Moves, n_predators: int, n_prey: int) -> tuple[Actions, Actions]:
    """Return all joint actions of the predators in a turn, and all of the prey.

    A joint action is an action for each agent of the team: int64 ``(n_joint, n_agents)``.
    """
    n_actions, n_prey_actions = moves.cell.shape[1:]
    predators = list(product(range(n_actions), repeat=n_predators))
    return np.array(predators), np.array(list(product(range(n_prey_actions), repeat=n_prey)))


def make_solution_work(n_predators: int, n_prey: int, moves: Moves) -> SolutionWork:
    """Return scratch arrays for a turn; each thread needs its own."""
    n_agents = n_predators + n_prey
    joints, flights = joint_actions(moves, n_predators, n_prey)
    work = make_workspace(len(joints), len(flights))
    return SolutionWork(work, np.zeros((n_prey, n_agents), np.int64), np.zeros(n_agents, np.int64), joints, flights)


@entry_point
def back_up(states: States, moves: Moves, later: Any, now: Any, first: int, last: int, room: SolutionWork) -> None:
    """Compute the values of some states from the values with one turn less."""
    for state in range(first, last):
        fill_payoffs(states.cells[state], states, moves, later, room)
        now[state] = equilibrium(room.work)


@rule
def fill_payoffs(cells: Any, states: States, moves: Moves, later: Any, room: SolutionWork) -> None:
    """Write the matrix game of a state: the predators' payoff for each joint action of theirs and of the prey."""
    n_prey, n_agents = room.seen.shape
    look_round(cells, moves.size, room.seen)
    for column in range(len(room.flights)):
        assign(room.flights[column], room.actions, n_agents - n_prey)
        for row in range(len(room.joints)):
            assign(room.joints[row], room.actions, 0)
            left, _, key = after_turn(room.seen, room.actions, moves)
            more = later[states.number[states.first_key[left - 1] + key]] if left > 0 else 0.0
            room.work.payoffs[row, column] = n_prey - left + more


@rule
def look_round(cells: Any, size: int, seen: Any) -> None:
    """Write the cell of every agent, seen from each prey, to ``seen``."""
    n_prey, n_agents = seen.shape
    for prey in range(n_prey):
        for i in range(n_agents):
            seen[prey, i] = seen_from(cells[i], cells[n_agents - n_prey + prey], size)


@rule
def assign(joint: Any, actions: Any, first: int) -> None:
    """Copy a joint action to the actions of its team, whose first agent is ``first``."""
    for i in range(len(joint)):
        actions[first + i] = joint[i]


@rule
def after_turn(seen: Any, actions: Any, moves: Moves) -> tuple[int, int, int]:
    """Return the number of prey that are free after a turn, the bits of these prey, and the key of their new state."""
    n_prey, n_agents = seen.shape
    n_predators, n_cells = n_agents - n_prey, moves.size * moves.size
    left, free, first = 0, 0, 0
    for prey in range(n_prey - 1, -1, -1):
        escapes = 1
        for i in range(n_predators):
            if moves.caught[seen[prey, i], actions[i], actions[n_predators + prey]]:
                escapes = 0
        if escapes:
            first = prey
        left += escapes
        free = free << 1 | escapes
    flight, key = actions[n_predators + first], 0
    for i in range(n_predators):
        key = key * n_cells + moves.cell[seen[first, i], actions[i], flight]
    for prey in range(first + 1, n_prey):
        if free >> prey & 1:
            cell = moves.apart[seen[first, n_predators + prey], actions[n_predators + prey], flight]
            key = key * n_cells + cell
    return left, free, key
