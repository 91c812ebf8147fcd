"""Measurements of a study's runs: their levels and behaviours, and all of them against each other."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from race.measure import GENERATIONS, Arrays, behaviours, is_measured, measured_file
from tqdm import tqdm

from esp_trainer.analysis.comparison import caught_by_each, held_out_opponents, script_panel
from esp_trainer.analysis.cross_play import cross_play
from esp_trainer.analysis.history import History
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.files import write_npz
from esp_trainer.jobs import in_processes
from esp_trainer.sweep.plan import PlannedRun
from esp_trainer.types import ROLES, Role, TeamBatch
from predprey_env.agents import other_team

LAST = 3
"""Champions of each run that meet those of the other runs: the last of the generations that are measured."""
PANEL_EPISODES = 16
"""Episodes of each of their meetings."""


def measure_all(place: Path, runs: Sequence[PlannedRun], kept: Path, workers: int) -> None:
    """Measure runs, each in a process of its own, and keep all measurements in one file, a run a row."""
    jobs = [(place, run) for run in runs if not is_measured(place, run)]
    in_processes(_measure_run, jobs, workers, "measuring")
    each = [dict(np.load(measured_file(place, run))) for run in runs]
    arrays = {name: np.stack([found[name] for found in each]) for name in each[0]}
    arrays["condition"] = np.array([run.cell for run in runs])
    arrays["met"] = _met(place, runs, workers)
    write_npz(kept, arrays)


def _measure_run(place: Path, run: PlannedRun) -> None:
    history = History.of_run(place / run.name)
    evaluator, generations = FusedEvaluator(history.config.env, threads=1), history.sample(GENERATIONS)
    found: Arrays = {"config": np.array(run.config.model_dump_json()), "generations": generations}
    for role in ROLES:
        mine = history.entrants(role, generations)
        for name, opponents in (("held_out", held_out_opponents(history.config.env)), ("scripts", script_panel())):
            caught = caught_by_each(role, mine, opponents[other_team(role)], evaluator)
            found[f"{name}.{role}"] = caught.astype(np.float32)
    write_npz(measured_file(place, run), found | behaviours(history, evaluator, generations))


def _met(place: Path, runs: Sequence[PlannedRun], workers: int) -> np.ndarray:
    """Return the fraction of prey that each run's last predators (rows) catch of each run's last prey (columns)."""
    histories = [History.of_run(place / run.name) for run in tqdm(runs, desc="reading", unit="run")]
    last: dict[Role, list[TeamBatch]] = {
        role: [each.entrants(role, each.sample(GENERATIONS)[-LAST:]) for each in histories] for role in ROLES
    }
    evaluator = FusedEvaluator(histories[0].config.env, threads=workers)

    def caught(predators: TeamBatch, prey: TeamBatch) -> float:
        return float(cross_play(predators, prey, evaluator, n_episodes=PANEL_EPISODES).payoff.mean())

    rows = tqdm(last["predators"], desc="all against all", unit="run")
    return np.array([[caught(predators, prey) for prey in last["prey"]] for predators in rows], np.float32)
