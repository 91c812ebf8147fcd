"""The value of the game: by torus, by time, by parity, by teams."""

from __future__ import annotations

import json
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from tqdm import tqdm

from esp_trainer.exact.solution import by_parity, solve
from predprey_env.config import EnvConfig

_WORDS = {"predator_idle": "predators may not idle", "move_order": "prey moves first and is seen"}


class Game(NamedTuple):
    """A torus, a time limit, and what differs from the paper's rules."""

    size: int
    steps: int
    fields: dict[str, Any] = {}  # noqa: RUF012 - never changed
    said: str = ""
    """What another program had found: all starts, and by the number of predators at an even distance."""

    @property
    def config(self) -> EnvConfig:
        """The world: one prey, unless it says otherwise."""
        return EnvConfig(**{"size": self.size, "n_prey": 1, **self.fields})

    @property
    def name(self) -> str:
        """As the table has it."""
        words = [_WORDS[field] for field in self.fields if field in _WORDS]
        return ", ".join([f"{self.size} x {self.size}, {self.steps}", *words])


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
SIZES = (4, 5, 6, 7, 8, 9, 10, 11, 12, 14, 16)
TEAMS = [
    Game(size, size * 3 // 2, {"n_predators": n_predators, "n_prey": n_prey})
    for n_predators, n_prey, sizes in (
        (1, 1, (4, 6, 8)),
        (2, 1, (4, 6, 8)),
        (3, 1, (4, 6, 8)),
        (4, 1, (4, 6)),
        (2, 2, (4, 6, 8)),
        (3, 2, (4, 6, 8)),
    )
    for size in sizes
]


class Value(NamedTuple):
    """A game solved."""

    game: Game
    curve: list[float]
    """The share of prey caught within 1, 2, ... steps."""
    by_even: list[float]
    """In all its time."""
    n_states: int
    seconds: float
    """Of wall time."""

    @property
    def mean(self) -> float:
        """In all its time."""
        return self.curve[-1]

    @property
    def half(self) -> int:
        """Steps within which half of the prey is caught."""
        return int(np.searchsorted(self.curve, 0.5)) + 1

    def __str__(self) -> str:
        return f"{self.mean:.3f}: " + " / ".join(f"{value:.3f}" for value in self.by_even)


def values(games: Iterable[Game], place: Path) -> list[Value]:
    """Solve each; what is found in ``place`` is not done again."""
    return [_value(game, place) for game in tqdm(list(games), unit="game")]


def by_size(sizes: Iterable[int], place: Path) -> list[tuple[Value, Value]]:
    """At one and a half times the size, as the paper's 150 steps on 100: with the idle action, and without."""
    games = [[Game(size, size * 3 // 2, fields) for fields in ({}, {"predator_idle": False})] for size in sizes]
    found = iter(values((game for pair in games for game in pair), place))
    return list(zip(found, found, strict=True))


def _value(game: Game, place: Path) -> Value:
    name = "-".join([f"{game.size}-{game.steps}", *(f"{field}-{value}" for field, value in game.fields.items())])
    kept = place / "values" / f"{name}.json"
    if not kept.exists():
        begun = time.perf_counter()
        solution = solve(game.config, game.steps)
        seconds = time.perf_counter() - begun
        means = [by_parity(solution, steps) for steps in range(1, game.steps + 1)]
        found = [[mean for mean, _ in means], means[-1][1], len(solution.states.cells), seconds]
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_text(json.dumps(found))
    return Value(game, *json.loads(kept.read_text()))
