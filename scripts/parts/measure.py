"""What is measured of the runs of a study: their levels and behaviours, and all of them against each other."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from race.measure import GENERATIONS, Arrays, behaviours, is_measured, keep, measured_file
from study import in_processes

from esp_trainer.analysis.comparison import caught_by_each, held_out_opponents, scripts
from esp_trainer.analysis.cross_play import cross_play
from esp_trainer.analysis.history import History
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.sweep.plan import PlannedRun
from esp_trainer.types import ROLES, Role, TeamBatch
from predprey_env.agents import other_team

LAST = 3
"""Champions of each run that meet those of the other runs: the last of the generations that are measured."""
EPISODES = 16
"""Episodes of each of their meetings."""


def measure_all(place: Path, runs: Sequence[PlannedRun], kept: Path, workers: int) -> None:
    """Measure runs, each in a process of its own, and keep all measurements in one file, a run a row."""
    jobs = [(place, run) for run in runs if not is_measured(place, run)]
    in_processes(_measure_run, jobs, workers, "measuring")
    jobs = [(place, run, runs) for run in runs if not _is_met(place, run, runs)]
    in_processes(_meet, jobs, workers, "all against all")
    each = [dict(np.load(measured_file(place, run))) for run in runs]
    arrays = {name: np.stack([found[name] for found in each]) for name in each[0]}
    arrays["condition"] = np.array([run.cell for run in runs])
    arrays["met"] = np.stack([np.load(_met_file(place, run))["met"] for run in runs])
    kept.parent.mkdir(parents=True, exist_ok=True)
    with kept.open("wb") as stream:
        np.savez_compressed(stream, **arrays)


def _measure_run(place: Path, run: PlannedRun) -> None:
    history = History.of_run(place / run.name)
    evaluator, generations = FusedEvaluator(history.config.env, threads=1), history.sample(GENERATIONS)
    found: Arrays = {"config": np.array(run.config.model_dump_json()), "generations": generations}
    for role in ROLES:
        mine = history.entrants(role, generations)
        for name, opponents in (("held_out", held_out_opponents(history.config.env)), ("scripts", scripts())):
            caught = caught_by_each(role, mine, opponents[other_team(role)], evaluator)
            found[f"{name}.{role}"] = caught.astype(np.float32)
    keep(measured_file(place, run), found | behaviours(history, evaluator, generations))


def _meet(place: Path, run: PlannedRun, runs: Sequence[PlannedRun]) -> None:
    """Keep the fraction of prey that the last predators of a run catch of each run's last prey, ``(n_runs,)``."""
    predators, evaluator = _last(place, run, "predators"), FusedEvaluator(run.config.env, threads=1)
    caught = [
        cross_play(predators, _last(place, each, "prey"), evaluator, n_episodes=EPISODES).payoff.mean() for each in runs
    ]
    keep(_met_file(place, run), {"met": np.array(caught, np.float32), "runs": _configs(runs)})


def _last(place: Path, run: PlannedRun, role: Role) -> TeamBatch:
    history = History.of_run(place / run.name)
    return history.entrants(role, history.sample(GENERATIONS)[-LAST:])


def _met_file(place: Path, run: PlannedRun) -> Path:
    return place / "measured" / f"{run.name}-met.npz"


def _is_met(place: Path, run: PlannedRun, runs: Sequence[PlannedRun]) -> bool:
    """Return whether a run has met these very runs."""
    file = _met_file(place, run)
    return file.exists() and bool(np.array_equal(np.load(file)["runs"], _configs(runs)))


def _configs(runs: Sequence[PlannedRun]) -> np.ndarray:
    return np.array([run.config.model_dump_json() for run in runs])
