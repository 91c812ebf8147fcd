"""A second panel, thought of after the runs: the last champions of the other runs of the same condition."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from study import table

from esp_trainer.analysis.gains import sixths
from esp_trainer.analysis.history import History
from esp_trainer.analysis.late_panel import late_gain, meet_late
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.files import write_npz
from esp_trainer.sweep.plan import PlannedRun
from esp_trainer.sweep.results import is_whole
from esp_trainer.types import ROLES
from race.measure import GENERATIONS, Arrays, load
from race.tables import arrows, marked

MIN_RUNS = 3


def file(kept: Path, task: str) -> Path:
    """Return where the measurements of a task are kept."""
    return kept / f"late-{task}.npz"


def measure(place: Path, runs: Sequence[PlannedRun], to: Path) -> None:
    """Measure the conditions of which enough runs lie in a directory, and keep that beside what is kept already."""
    found = load(to)
    for condition in dict.fromkeys(run.cell for run in runs):
        paths = [place / run.name for run in runs if run.cell == condition and is_whole(place / run.name, run)]
        if len(paths) >= MIN_RUNS:
            histories = [History.of_run(path) for path in paths]
            met = meet_late(histories, FusedEvaluator(histories[0].config.env, threads=1), GENERATIONS)
            found |= {f"{condition}.{role}": results for role, results in met.items()}
    if found:
        write_npz(to, found)


def caught_by_others(kept: Path, condition: str) -> float | None:
    """Return how many of the other runs' late prey the late predators of a condition catch; None if nobody looked."""
    found = load(kept).get(f"{condition}.predators")
    return None if found is None else float(np.nanmean(sixths(found)[1]))


def tell(kept: Path) -> str | None:
    """Return what is kept as Markdown, or None if nothing is."""
    found = load(kept)
    if not found:
        return None
    rows = []
    for condition in dict.fromkeys(name.rpartition(".")[0] for name in found):
        n_runs = len(found[f"{condition}.prey"])
        rows.append([marked(condition, n_runs), n_runs, *(_cell(found[f"{condition}.{role}"]) for role in ROLES)])
    heads = ["condition", "runs", *(f"{role}: course, gain, gain in the 2nd half" for role in ROLES)]
    return "\n\n".join([_TEXT, table(heads, rows), _verdict(found)])


def _cell(found: np.ndarray) -> str:
    first, last = sixths(found)
    middle = found[:, found.shape[1] // 2 :][:, : first.shape[1]]
    course = np.array([np.nanmean(part) for part in (first, middle, last)])
    return f"{arrows(course)}; {late_gain(found, half=False)}; {late_gain(found, half=True)}"


def _verdict(found: Arrays) -> str:
    """Return what the conditions say of the second half."""
    told = []
    for condition in ("race", "growing-steps"):
        if f"{condition}.prey" in found:
            gains = (f"the {role} gain {late_gain(found[f'{condition}.{role}'], half=True)}" for role in ROLES)
            told.append(f"In the second half of `{condition}` {' and '.join(gains)}.")
    return " ".join(told)


_TEXT = """\
A stronger panel: the champions of each run also meet those of the last sixth of the other runs of their condition whose
files were kept. With one prey it was thought of after the results were known. The course is from the first sixth of a
run over its middle to the last sixth."""
