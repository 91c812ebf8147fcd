"""Measurements of a run, from its champions alone; all opponents are fixed."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from esp_trainer.analysis.best_response import evolve_response
from esp_trainer.analysis.comparison import Panel, caught_by_each, held_out_opponents, script_panel
from esp_trainer.analysis.cross_play import PANEL, own_cross_play
from esp_trainer.analysis.exploiters import exploiters_of
from esp_trainer.analysis.history import History
from esp_trainer.analysis.watch import watch_behaviours
from esp_trainer.config import RunConfig
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.files import write_npz
from esp_trainer.jobs import in_processes
from esp_trainer.report.source import SPREADS, read_source
from esp_trainer.sweep.plan import PlannedRun
from esp_trainer.types import ROLES
from predprey_env.agents import other_team

GENERATIONS = 24
"""Generations of a run that meet the panels and each other, and are watched for behaviours, evenly spread."""
RESPONSES = 3
"""Generations of a run that fresh evolution meets: the last of each third."""
RESPONSE_GENERATIONS = 60
_RESPONSE_SEED = 3000
PER_RUN = PANEL
"""Champions of each run of the panel."""

Arrays = dict[str, np.ndarray]
Task = dict[str, Arrays]
"""The measurements of each condition of a task."""


def measured_file(place: Path, run: PlannedRun) -> Path:
    """Return where the measurements of a run are kept."""
    return place / "measured" / f"{run.name}.npz"


def is_measured(place: Path, run: PlannedRun) -> bool:
    """Return whether a run of this very config has been measured."""
    file = measured_file(place, run)
    if not file.exists():
        return False
    with np.load(file) as arrays:
        return str(arrays["config"]) == run.config.model_dump_json()


def measure_all(place: Path, runs: Sequence[PlannedRun], panel: Sequence[Path], workers: int) -> None:
    """Measure the runs that have not been measured yet, each in a process of its own."""
    jobs = [(place, run, panel) for run in runs if not is_measured(place, run)]
    in_processes(_measure_run, jobs, workers, "measuring")


def _measure_run(place: Path, run: PlannedRun, panel: Sequence[Path]) -> None:
    source = read_source(place / run.name)
    history = source.history
    if history is None or len(history) < run.config.generations:
        raise ValueError(f"{place / run.name} is not whole: {'; '.join(source.missing)}")
    evaluator = FusedEvaluator(history.config.env, threads=1)
    generations = history.sample(GENERATIONS)
    found: Arrays = {"config": np.array(run.config.model_dump_json()), "generations": generations}
    found |= {"caught": history.curves["caught"].astype(np.float32)}
    for role, spreads in source.spreads.items():
        found |= {f"{name}.{role}": spreads[:, i].astype(np.float32) for i, name in enumerate(SPREADS)}
    panels = {
        "panel": _members(panel),
        "held_out": held_out_opponents(history.config.env, older_only=True),
        "scripts": script_panel(),
    }
    for role in history.champions:
        mine = history.entrants(role, generations)
        for name, opponents in panels.items():
            if theirs := opponents[other_team(role)]:
                found[f"{name}.{role}"] = caught_by_each(role, mine, theirs, evaluator).astype(np.float32)
    if len(history.champions) == len(ROLES):
        found["own"] = own_cross_play(history, evaluator, n_generations=GENERATIONS).caught.astype(np.float32)
        found |= behaviours(history, evaluator, generations)
        found |= _responses(history, evaluator)
    write_npz(measured_file(place, run), found)


def _members(panel: Sequence[Path]) -> Panel:
    """Return the champions of the panel's runs, :data:`PER_RUN` of each."""
    found: Panel = {"predators": [], "prey": []}
    for path in panel:
        member = History.of_run(path)
        for role in member.champions:
            found[role].append(member.entrants(role, member.sample(PER_RUN)))
    return found


def behaviours(history: History, evaluator: FusedEvaluator, generations: np.ndarray) -> Arrays:
    """Return rates and null rates of every behaviour in champion against champion, ``(GENERATIONS, 2)`` each."""
    rates = watch_behaviours(history, evaluator, generations)
    return {f"behaviour.{name}": np.array([(r.rate, r.null) for r in row], np.float32) for name, row in rates.items()}


def _responses(history: History, evaluator: FusedEvaluator) -> Arrays:
    """Return what fresh evolution takes from either side's champions of several generations: prey caught by their
    contemporaries and by the best response, ``(RESPONSES, 2)`` for the side that evolves anew.
    """
    kept = history.kept
    frozen = kept[np.searchsorted(kept, len(history) * np.arange(1, RESPONSES + 1) // RESPONSES - 1)]
    found: Arrays = {"response.generations": frozen}
    for role in history.champions:
        answers = [
            evolve_response(
                history,
                role,
                evaluator,
                generation=int(generation),
                n_generations=min(RESPONSE_GENERATIONS, len(history)),  # fewer in small
                seed=_RESPONSE_SEED + history.config.seed,
            )
            for generation in frozen
        ]
        found[f"response.{role}"] = np.array([(each.before, each.after) for each in answers])
    return found


def gather(place: Path, runs: Sequence[PlannedRun], kept: Path) -> None:
    """Keep what is measured of the runs of each condition in one file, a run a row, beside what it keeps already."""
    for condition in dict.fromkeys(run.cell for run in runs):
        file = kept / f"{condition}.npz"
        rows = kept_rows(file)
        for run in runs:
            if run.cell == condition and is_measured(place, run):
                rows[run.config.model_dump_json()] = _measurements(place, run)
        each = [rows[key] for run in runs if run.cell == condition and (key := run.config.model_dump_json()) in rows]
        if each:
            shared = [name for name in each[0] if all(name in found for found in each)]
            write_npz(file, {name: np.stack([found[name] for found in each]) for name in shared})


def load(file: Path) -> Arrays:
    """Return the arrays of a file; none if there is no file."""
    if not file.exists():
        return {}
    with np.load(file) as arrays:
        return dict(arrays)


def kept_rows(file: Path) -> dict[str, Arrays]:
    """Return the measurements of each run in a condition's file, by the run's config as it is written today."""
    if not (whole := load(file)):
        return {}
    configs = [RunConfig.from_dict(json.loads(str(config))) for config in whole["config"]]
    return {
        config.model_dump_json(): {name: values[row] for name, values in whole.items()}
        for row, config in enumerate(configs)
    }


def _measurements(place: Path, run: PlannedRun) -> Arrays:
    return load(measured_file(place, run)) | _exploited(place / run.name)


def _exploited(path: Path) -> Arrays:
    """Return what each exploiter of a run caught (or lost) of the other side's champion, ``(n_exploiters,)`` for each
    side, with the generations; nothing of a run without exploiters.
    """
    found = exploiters_of(path)
    if not len(found.generations):
        return {}
    caught = {"predators": found.reached["predators"], "prey": 1.0 - found.reached["prey"]}
    return {f"exploited.{role}": caught[role] for role in ROLES} | {"exploited.generations": found.generations}
