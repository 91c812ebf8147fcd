"""A second panel, thought of after the runs: the last champions of the other runs of the same condition."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from study import keep, table

from esp_trainer.analysis.comparison import caught_by_each
from esp_trainer.analysis.gains import RESAMPLES, Interval
from esp_trainer.analysis.history import History
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.sweep.plan import PlannedRun
from esp_trainer.sweep.results import is_whole
from esp_trainer.types import ROLES, Role
from predprey_env.agents import other_team
from race.endpoints import gained, sixths
from race.measure import GENERATIONS, Arrays
from race.tables import marked

LATE = 3
"""Champions of each run that the others meet, evenly spread over its last sixth."""
MIN_RUNS = 3


def file(kept: Path, task: str) -> Path:
    """Return where the measurements of a task are kept."""
    return kept / f"late-{task}.npz"


def measure(place: Path, runs: Sequence[PlannedRun], to: Path) -> None:
    """Measure the conditions of which enough runs lie in a directory, and keep that beside what is kept already."""
    found = _load(to)
    for condition in dict.fromkeys(run.cell for run in runs):
        paths = [place / run.name for run in runs if run.cell == condition and is_whole(place / run.name, run)]
        if len(paths) >= MIN_RUNS:
            met = _meet([History.of_run(path) for path in paths])
            found |= {f"{condition}.{role}": results for role, results in met.items()}
    if found:
        keep(to, found)


def _load(kept: Path) -> Arrays:
    if not kept.exists():
        return {}
    with np.load(kept) as arrays:
        return dict(arrays)


def _meet(histories: Sequence[History]) -> dict[Role, np.ndarray]:
    """Return what each run's generations did against the late champions of each other run, higher is better:
    ``(n_runs, n_generations, n_runs)``, NaN where they are its own.
    """
    n, evaluator = len(histories), FusedEvaluator(histories[0].config.env, threads=1)
    n_sampled = len(histories[0].sample(GENERATIONS))
    found: dict[Role, np.ndarray] = {role: np.full((n, n_sampled, n), np.nan, np.float32) for role in ROLES}
    for role in ROLES:
        late = [each.entrants(other_team(role), _last_sixth(each)) for each in histories]
        for i, history in enumerate(histories):
            mine, others = history.entrants(role, history.sample(GENERATIONS)), [j for j in range(n) if j != i]
            caught = caught_by_each(role, mine, [late[j] for j in others], evaluator)
            by_run = caught.reshape(len(caught), len(others), -1).mean(axis=2)
            found[role][i][:, others] = by_run if role == "predators" else 1 - by_run
    return found


def _last_sixth(history: History) -> np.ndarray:
    wanted = np.linspace(5 * len(history) // 6, len(history) - 1, LATE)
    return history.kept[np.searchsorted(history.kept, wanted.astype(int))]


def gain(found: np.ndarray, *, half: bool) -> Interval:
    """Return what runs gain against the others' late champions: the last sixth of their generations less the first, of
    the whole run or of its second half.

    The interval is a percentile one. Runs are drawn with replacement, each as a run and as a member of the panel; a run
    never meets itself.
    """
    gains = gained(found, half=half)
    apart = ~np.eye(len(gains), dtype=bool)
    drawn = np.random.default_rng(0).multinomial(len(gains), np.full(len(gains), 1 / len(gains)), RESAMPLES)
    sums, weights = (
        np.einsum("bi,ij,bj->b", drawn, each, drawn, optimize=True)
        for each in (np.where(apart, gains, 0.0), 1.0 * apart)
    )
    low, high = np.quantile((sums / np.maximum(weights, 1))[weights > 0], [0.025, 0.975])
    return Interval(float(gains[apart].mean()), float(low), float(high))


def caught_by_others(kept: Path, condition: str) -> float | None:
    """Return how many of the other runs' late prey the late predators of a condition catch; None if nobody looked."""
    found = _load(kept).get(f"{condition}.predators")
    return None if found is None else float(np.nanmean(sixths(found)[1]))


def tell(kept: Path) -> str | None:
    """Return what is kept as Markdown, or None if nothing is."""
    found = _load(kept)
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
    course = (np.nanmean(part) for part in (first, middle, last))
    return f"{' -> '.join(f'{each:.2f}' for each in course)}; {gain(found, half=False)}; {gain(found, half=True)}"


def _verdict(found: Arrays) -> str:
    """Return what the conditions say of the second half."""
    told = []
    for condition in ("race", "growing-steps"):
        if f"{condition}.prey" in found:
            gains = (f"the {role} gain {gain(found[f'{condition}.{role}'], half=True)}" for role in ROLES)
            told.append(f"In the second half of `{condition}` {' and '.join(gains)}.")
    return " ".join(told)


_TEXT = """\
A stronger panel: the champions of each run also meet those of the last sixth of the other runs of their condition whose
files were kept. With one prey it was thought of after the results were known. The course is from the first sixth of a
run over its middle to the last sixth."""
