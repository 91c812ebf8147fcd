"""Everybody against everybody, and against the held-out teams of the zoo."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
from tqdm import tqdm

from esp_trainer import Team
from esp_trainer.analysis.cross_play import cross_play
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.files import write_npz
from esp_trainer.tasks import WORLDS
from esp_trainer.teams.zoo import known_teams, load_team
from esp_trainer.types import ROLES, Role, ScriptedTeams, TeamBatch
from learners.contestants import TASK, TeamKind
from learners.train import spent_file, team_file


class Kept:
    """A dataclass of arrays that can be kept in a file."""

    def save(self, path: Path) -> None:
        """Write it to a file."""
        write_npz(path, vars(self))

    @classmethod
    def load(cls, path: Path) -> Self:
        """Read what :meth:`save` wrote."""
        with np.load(path) as arrays:
            return cls(**{name: array if array.ndim else array.item() for name, array in arrays.items()})


@dataclass(frozen=True)
class Matrix(Kept):
    """Payoffs of all pairs of teams; rows are predators."""

    predators: np.ndarray
    """str ``(P,)``: whose teams the rows are; each as often as it has seeds."""
    prey: np.ndarray
    """str ``(Q,)``: likewise for the columns."""
    caught: np.ndarray
    """float64 ``(P, Q)``: fraction of prey caught."""
    predators_held_out: np.ndarray
    """float64 ``(P, H)``: the same against the held-out prey of the zoo."""
    prey_held_out: np.ndarray
    """float64 ``(H, Q)``: against the held-out predators."""
    predators_spent: np.ndarray
    """float64 ``(P, 2)``: CPU seconds, and steps of agents, that the teams cost; nan for scripts."""
    prey_spent: np.ndarray
    """float64 ``(Q, 2)``."""
    meanings: np.ndarray
    """str ``(n, 2)``: names of contestants and what they are, in the order of the tables."""
    n_episodes: int


def play(contestants: Iterable[TeamKind], place: Path, n_episodes: int) -> Matrix:
    """Let all meet, each pair from the same starts; return who catches whom."""
    contestants, env = list(contestants), WORLDS[TASK]
    evaluator = FusedEvaluator(env)
    sides = {
        role: [(each, seed) for each in contestants if role in each.roles for seed in each.seeds] for role in ROLES
    }
    teams: dict[Role, list[TeamBatch]] = {
        role: [_teams(each, place, role, seed) for each, seed in side] for role, side in sides.items()
    }
    panel: dict[Role, list[TeamBatch]] = {
        role: [
            load_team(name).as_teams(1)
            for name, t in known_teams().items()
            if t.held_out and (t.role, t.task) == (role, TASK)
        ]
        for role in ROLES
    }

    def table(rows: list[TeamBatch], columns: list[TeamBatch]) -> np.ndarray:
        meetings = [
            [cross_play(p, q, evaluator, n_episodes=n_episodes, seed=3).caught for q in columns] for p in tqdm(rows)
        ]
        return np.array(meetings)[..., 0, 0]

    return Matrix(
        predators=np.array([each.name for each, _ in sides["predators"]]),
        prey=np.array([each.name for each, _ in sides["prey"]]),
        caught=table(teams["predators"], teams["prey"]),
        predators_held_out=table(teams["predators"], panel["prey"]),
        prey_held_out=table(panel["predators"], teams["prey"]),
        predators_spent=np.array([_spent(each, place, "predators", seed) for each, seed in sides["predators"]]),
        prey_spent=np.array([_spent(each, place, "prey", seed) for each, seed in sides["prey"]]),
        meanings=np.array([(each.name, each.meaning) for each in contestants]),
        n_episodes=n_episodes,
    )


def _teams(contestant: TeamKind, place: Path, role: Role, seed: int) -> TeamBatch:
    if contestant.method == "script":
        return ScriptedTeams(contestant.name)
    return Team.load(team_file(place, contestant, role, seed)).as_teams(1)


def _spent(contestant: TeamKind, place: Path, role: Role, seed: int) -> tuple[float, float]:
    """Return the CPU seconds and the steps of agents; of teams that learn together, those of both."""
    if contestant.method == "script":
        return float("nan"), float("nan")
    file = spent_file(place, contestant, role, seed)
    if contestant.method != "ppo":
        told = json.loads(file.read_text())
        return told["cpu_seconds"], told["steps"]
    with file.open() as rows:
        lines = list(csv.DictReader(rows))
    until = lines[: round(len(lines) * contestant.part / 10)]
    steps = {line["role"]: int(line["steps"]) for line in until}
    return float(until[-1]["cpu_seconds"]), float(sum(steps.values()))
