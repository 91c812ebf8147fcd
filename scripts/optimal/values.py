"""The value of the game: by torus, by time, by parity."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any, NamedTuple

from esp_trainer.exact.solution import by_parity, solve
from predprey_env.config import EnvConfig


class Game(NamedTuple):
    """A torus, a time limit, and what differs from the paper's rules."""

    size: int
    steps: int
    fields: dict[str, Any]
    said: str
    """What another program had found: all starts, and by the number of predators at an even distance."""

    @property
    def name(self) -> str:
        """As the table has it."""
        words = {"predator_idle": "predators may not idle", "move_order": "prey moves first and is seen"}
        return ", ".join([f"{self.size} x {self.size}, {self.steps}", *(words[field] for field in self.fields)])


KNOWN = [
    Game(6, 5, {}, "0.798: 0.704 / 0.777 / 0.830 / 0.872"),
    Game(6, 10, {}, "0.994: 0.991 / 0.993 / 0.995 / 0.996"),
    Game(6, 20, {"predator_idle": False}, "0.123: 0.000 / 0.000 / 0.023 / 1.000"),
    Game(6, 5, {"move_order": "prey_first"}, "1.000: 0.997 / 1.000 / 1.000 / 1.000"),
    Game(8, 10, {}, "0.853: 0.823 / 0.844 / 0.863 / 0.881"),
    Game(10, 15, {}, "0.841: 0.821 / 0.835 / 0.848 / 0.860"),
    Game(9, 15, {"predator_idle": False}, "0.380: 0.372 / 0.383 / 0.382 / 0.373"),
]
"""What a prototype had found before the solver was written."""


class Value(NamedTuple):
    """A game solved."""

    game: Game
    mean: float
    by_even: list[float]
    n_states: int
    seconds: float
    """Of wall time."""

    def __str__(self) -> str:
        return f"{self.mean:.3f}: " + " / ".join(f"{value:.3f}" for value in self.by_even)


def confirm(games: Sequence[Game]) -> list[Value]:
    """Solve each."""
    return [_value(game) for game in games]


def by_size(sizes: Sequence[int]) -> list[tuple[Value, Value]]:
    """At one and a half times the size, as the paper's 150 steps on 100: with the idle action, and without."""
    found = []
    for size in sizes:
        with_idling = _value(Game(size, size * 3 // 2, {}, ""))
        without = _value(Game(size, size * 3 // 2, {"predator_idle": False}, ""))
        found.append((with_idling, without))
    return found


def _value(game: Game) -> Value:
    begun = time.perf_counter()
    solution = solve(EnvConfig(size=game.size, n_prey=1, **game.fields), game.steps)
    seconds = time.perf_counter() - begun
    return Value(game, *by_parity(solution, game.steps), len(solution.states.cells), seconds)
