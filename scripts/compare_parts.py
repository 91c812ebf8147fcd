"""Study how a replaced part changes a race: algorithms and senses, from nothing to their pages.

The runs are those of ``studies/*.toml``. The script does the runs that are missing, measures them, and writes
``docs/algorithms.md`` and ``docs/senses.md``. It can be stopped at any moment and started again. The runs
of one prey take some two and a half hours of CPU.

    python scripts/compare_parts.py                    # into docs/
    python scripts/compare_parts.py --only senses-3v1  # the runs of these plans
    python scripts/compare_parts.py --report           # only the pages again, from the measurements that are kept
    python scripts/compare_parts.py --quick            # small and meaningless, into runs/parts-quick
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # workers of the pools import it too

import numpy as np
from parts import report
from parts.measure import measure_all
from study import SMALL, StudyParser

from esp_trainer.sweep.plan import PlannedRun, read_plan
from esp_trainer.sweep.run_all import run_all

HERE = Path(__file__).parent
TASKS = {"algorithms": ("3v1", "steppe"), "senses": ("3v1",)}
"""Tasks of each study, which is also the name of its page."""
STUDY_BEHAVIOURS = {
    "algorithms": (),
    "senses": ("role switch", "blocker", "opposing attack", "baiting", "sidestepping", "reversal"),
}
PLANS = [f"{study}-{task}" for study, tasks in TASKS.items() for task in tasks]


def main() -> None:
    """Do and measure the missing runs, and write the pages."""
    parser = StudyParser(__doc__, "runs", "runs/parts-quick")
    parser.add_argument("--only", nargs="+", choices=PLANS, default=PLANS, help="only the runs of these plans")
    options = parser.read()
    runs, out = options.runs, options.out
    for plan in () if options.report else options.only:
        planned = _planned(plan, options.quick)
        run_all(runs / plan, planned, options.workers)
        measure_all(runs / plan, planned, _kept(out, plan), options.workers)
    for study, tasks in TASKS.items():
        there = {task: file for task in tasks if (file := _kept(out, f"{study}-{task}")).exists()}
        if there:
            found = {task: dict(np.load(file)) for task, file in there.items()}
            report.write(HERE / "parts" / f"{study}.md", found, STUDY_BEHAVIOURS[study], out)


def _kept(out: Path, plan: str) -> Path:
    study, _, task = plan.partition("-")
    return out / study / f"{task}.npz"


def _planned(name: str, quick: bool) -> list[PlannedRun]:
    plan = read_plan(HERE / "studies" / f"{name}.toml")
    if not quick:
        return plan
    first = list(dict.fromkeys(run.cell for run in plan))[:2]
    chosen = [run for run in plan if run.cell in first and run.config.seed < 2]
    return [replace(run, config=run.config.with_fields(SMALL)) for run in chosen]


if __name__ == "__main__":
    main()
