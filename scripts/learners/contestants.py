"""Teams that are compared: how each kind is made, and with which seeds."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, replace
from pathlib import Path

TASK = "3v2"
SEEDS = (700, 701, 702, 703, 704)
PPO_STEPS = 15_000_000
"""Steps of agents of one side; self-play has as many for each."""
ESP_GENERATIONS = 450


@dataclass(frozen=True)
class TeamKind:
    """A kind of team."""

    name: str
    meaning: str
    method: str
    """``ppo``, ``evolved``, ``answer`` (evolved against frozen PPO) or ``script``."""
    roles: tuple[str, ...] = ("predators", "prey")
    """Its sides."""
    seeds: tuple[int, ...] = SEEDS
    reward: str = "dense"
    """Reward of PPO."""
    trained: str = "apart"
    """How PPO trains: the sides ``apart``, each against the zoo, or ``together``, against each other."""
    part: int = 10
    """Number of the checkpoint of PPO, from 1 to 10."""
    steps: int = PPO_STEPS
    n_worlds: int = 8
    """Worlds of PPO for each opponent."""
    preset: str = ""
    """Preset of evolved teams."""
    generations: int = ESP_GENERATIONS

    @property
    def run(self) -> str:
        """Name of the run that it comes from; several contestants may share one."""
        return f"{self.trained}-{self.reward}" if self.method == "ppo" else self.name


def _read() -> list[TeamKind]:
    declared = tomllib.loads(Path(__file__).with_suffix(".toml").read_text())["contestant"]
    lists = ("roles", "seeds")
    return [TeamKind(**{k: tuple(v) if k in lists else v for k, v in entry.items()}) for entry in declared]


CONTESTANTS = _read()
"""In the order of the tables."""


def small(contestant: TeamKind) -> TeamKind:
    """Return a contestant that is trained in seconds."""
    seeds = contestant.seeds[:2]
    return replace(
        contestant, seeds=seeds, steps=150_000, n_worlds=1, generations=max(2, contestant.generations // 200)
    )
