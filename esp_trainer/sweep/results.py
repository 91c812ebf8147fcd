"""Results of a sweep: a line for each run, and the means over seeds for each cell."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from esp_trainer.analysis.inference import summary
from esp_trainer.coevolution.hall_of_fame import kept_generations
from esp_trainer.config import RunConfig
from esp_trainer.files import write_table
from esp_trainer.run.checkpoint import load_champions
from esp_trainer.run.directory import RunDirectory, records, whole_lines
from esp_trainer.sweep.plan import PlannedRun

RECENT = 20
"""Number of last generations over which the figures of a run are averaged."""
FIGURES = ("caught", "predators_succeed", "prey_succeed")
"""Results of champion against champion, from held-out starts."""
PAYOFF_FIGURES = ("payoff",)
"""Results in another game than the predator-prey world."""


def figures_of(config: RunConfig) -> tuple[str, ...]:
    """Return the names of the results of a run."""
    return PAYOFF_FIGURES if config.game.environment else FIGURES


@dataclass(frozen=True)
class RunResult:
    """A run of a sweep, with its results so far."""

    run: PlannedRun
    generations: int
    figures: dict[str, float]
    """Means of :func:`figures_of` the run over the run's last generations; empty if there are none."""
    reason: str | None
    """Reason of the failure; None for a run that did not fail."""
    whole: bool
    """True if there is nothing left to do."""


def is_whole(path: Path, run: PlannedRun) -> bool:
    """Return whether a run is complete.

    A damaged run, or another run in its directory, counts as incomplete; the worker that gets it refuses it.
    """
    directory, config = RunDirectory(path), run.config
    try:
        champions, done = load_champions(directory.checkpoint_file, config)
        if not directory.config_file.exists() or len(records(directory.metrics_file)) != done:
            return False
    except (OSError, ValueError):
        return False
    kept = kept_generations(done, config.esp.hof_size).tolist()
    return done == config.generations and all(directory.champion_generations(role) == kept for role in champions)


def result_of(path: Path, run: PlannedRun, reason: str | None) -> RunResult:
    """Return a run's result from its log; a run that failed has no figures."""
    whole = reason is None and is_whole(path, run)
    lines: Sequence[bytes] = []
    try:
        lines = whole_lines(RunDirectory(path).metrics_file)
        recent = [json.loads(line)["held_out"] for line in lines[-RECENT:]]
        names = figures_of(run.config) if recent else ()
        figures = {name: sum(each[name]["rate"] for each in recent) / len(recent) for name in names}
    except (OSError, ValueError, TypeError, KeyError, RecursionError) as error:
        return RunResult(run, len(lines), {}, reason or f"its log is damaged: {error}", whole=False)
    return RunResult(run, len(lines), {} if reason else figures, reason, whole)


def write_csv(file: Path, results: Sequence[RunResult]) -> None:
    """Write a CSV file with a line for each run."""
    names = _names(results)
    lines = [["run", "cell", "seed", "generations", *names, "failed"]]
    for each in results:
        figures = [f"{each.figures[name]:.4f}" if name in each.figures else "" for name in names]
        seed, generations = str(each.run.config.seed), str(each.generations)
        lines.append([each.run.name, each.run.cell, seed, generations, *figures, each.reason or ""])
    write_table(file, lines)


def sweep_table(results: Sequence[RunResult]) -> list[str]:
    """Return a line for each cell: the number of complete runs, and the means over them with 95% intervals."""
    names = _names(results)
    cells = dict.fromkeys(result.run.cell for result in results)
    width = max(map(len, ("", *cells)))
    heads = "".join(f"{name.replace('_', ' '):>24}" for name in names)
    lines = [f"{'':{width}}{'runs':>8}{heads}"]
    for cell in cells:
        runs = [result for result in results if result.run.cell == cell]
        whole = [result for result in runs if result.whole]
        known = {name: [result.figures[name] for result in whole if name in result.figures] for name in names}
        figures = "".join(f"{summary(values):>24}" for values in known.values())
        lines.append(f"{cell:{width}}{f'{len(whole)}/{len(runs)}':>8}{figures}")
    return lines


def _names(results: Sequence[RunResult]) -> list[str]:
    """Return the names of the results of all runs, each once."""
    return list(dict.fromkeys(name for result in results for name in figures_of(result.run.config)))
