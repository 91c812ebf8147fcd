"""Does the race go on? The runs of ``docs/race-protocol.md``, from nothing to ``docs/race.md``.

Each task has a sweep of conditions and one of held-out opponents, ``race/*.toml``; one task also has long runs. The
script does the runs whose measurements are not kept yet, measures them, keeps that, a condition a file, and writes the
page. It can be stopped at any moment and started again. The whole takes many hours on two cores; ``--quick`` does all
of it in small, to see that it works (its figures mean nothing).

    python scripts/prove_race.py                          # into docs/
    python scripts/prove_race.py --only race paper        # these conditions first
    python scripts/prove_race.py --late                   # the runs that are there meet each other's last champions
    python scripts/prove_race.py --report                 # only the page again, from the measurements that are kept
    python scripts/prove_race.py --quick                  # into runs/race-quick
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # workers of the pools import it too

from race import late, report
from race.measure import gather, kept_rows, measure_all
from study import SMALL, SMALL_WORLD, StudyParser

from esp_trainer.sweep.plan import PlannedRun, read_plan
from esp_trainer.sweep.run_all import run_all

PLACE = Path(__file__).parent / "race"
TASKS = ("3v1", "3v2", "steppe")


def main() -> None:
    """Do and measure the missing runs, and write the page."""
    parser = StudyParser(__doc__, "runs/race", "runs/race-quick")
    parser.add_argument("--tasks", nargs="+", choices=TASKS, default=TASKS)
    parser.add_argument("--only", nargs="+", metavar="CONDITION", help="only these conditions")
    parser.add_argument("--seeds", type=int, metavar="N", help="only the first seeds of each condition")
    parser.add_argument("--late", action="store_true", help="only let the runs meet each other's last champions")
    options = parser.read()
    kept = options.out / "race" / "data"
    for task in options.tasks:
        panel = _plan(f"panel-{task}", options.quick)
        plan = [run for kind in ("conditions", "long") for run in _plan(f"{kind}-{task}", options.quick)]
        for condition in () if options.report or options.late else dict.fromkeys(run.cell for run in plan):
            if not options.only or condition in options.only:
                runs = [run for run in plan if run.cell == condition]
                _do(options.runs / task, panel, runs, options.seeds or len(runs), kept / task, options.workers)
        if options.late or options.quick:
            late.measure(options.runs / task, plan, late.file(kept, task))
    report.write(kept, options.out)


def _plan(name: str, quick: bool) -> list[PlannedRun]:
    file = PLACE / f"{name}.toml"
    plan = read_plan(file) if file.exists() else []
    if not quick:
        return plan
    small = [run for run in plan if _rank(run, plan) < 3]
    return [replace(run, config=run.config.with_fields(SMALL | SMALL_WORLD)) for run in small]


def _rank(run: PlannedRun, plan: list[PlannedRun]) -> int:
    """Return the place of a run's seed among those of its condition."""
    return [each.config.seed for each in plan if each.cell == run.cell].index(run.config.seed)


def _do(place: Path, panel: list[PlannedRun], runs: list[PlannedRun], n: int, kept: Path, workers: int) -> None:
    """Do and measure the first ``n`` runs of a condition, but for those whose measurements are kept already."""
    there = kept_rows(kept / f"{runs[0].cell}.npz")
    todo = [run for run in runs[:n] if run.config.model_dump_json() not in there]
    if todo:
        run_all(place / "panel", panel, workers)
        run_all(place, todo, workers)
        measure_all(place, todo, [place / "panel" / run.name for run in panel], workers)
        gather(place, runs, kept)


if __name__ == "__main__":
    main()
