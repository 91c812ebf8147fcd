"""The paper's experiments over many seeds, from nothing to ``docs/reproduction.md``.

Does the runs of the sweeps in ``reproduction/settings``, measures each, keeps the measurements of a setting whose runs
are all measured, and writes the page with its figures. It can be stopped at any moment and started again: a setting
that is kept is not run again. The whole takes some hours on two cores; ``--quick`` does all of it in small, in a
minute, to see that it works (its figures mean nothing).

    python scripts/reproduce_paper.py              # into docs/
    python scripts/reproduce_paper.py --report     # only the page and figures again, from the data that is kept
    python scripts/reproduce_paper.py --quick      # into runs/quick
"""

from __future__ import annotations

import sys
from importlib.metadata import version
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # workers of the pools import it too

from race.measure import gather, is_measured
from reproduction import figures, moments, report
from reproduction.claims import read_claims, verdicts
from reproduction.measure import measure
from reproduction.results import StudyResults, load
from reproduction.settings import Setting, read_settings, small
from study import StudyParser, commit

from esp_trainer.jobs import in_processes
from esp_trainer.sweep.run_all import run_all


def main() -> None:
    """Do what is still to do."""
    parser = StudyParser(__doc__, "runs/reproduction", "runs/quick")
    options = parser.read()
    runs, out = options.runs, options.out
    settings = small(read_settings()) if options.quick else read_settings()
    kept = out / "reproduction" / "data"
    panels = [each for each in settings.values() if each.part == "panel"]
    reported = [each for each in settings.values() if each.part != "panel"]
    if not options.report:
        run([each for each in reported if load(kept, each) is None], panels, runs, kept, options.workers)
    found = {each.name: load(kept, each) for each in reported}
    results = {name: each for name, each in found.items() if each is not None}
    if not results:
        parser.error(f"there is nothing to report on in {kept}")
    if not options.report:
        moments.find(runs, results, kept)
    draw(results, kept)
    report.write(
        results, verdicts(read_claims(), results), made_by([name for name in found if name not in results]), out
    )
    print(f"{out / 'reproduction.md'}: {len(results)} of {len(found)} settings")


def run(settings: list[Setting], panels: list[Setting], runs: Path, kept: Path, workers: int) -> None:
    """Evolve and measure settings, first the panels of held-out runs that they are measured against."""
    worlds = [setting.world for setting in settings]
    panels = [panel for panel in panels if panel.world in worlds]
    run_all(runs, [run for setting in [*panels, *settings] for run in setting.runs], workers)
    jobs = []
    for setting in settings:
        panel = [runs / run.name for each in panels if each.world == setting.world for run in each.runs]
        todo = [run for run in setting.runs if not is_measured(runs, run)]
        jobs += [(runs, run, panel, setting.part == "paper") for run in todo]
    in_processes(measure, jobs, workers, "measuring")
    for setting in settings:
        gather(runs, setting.runs, kept)


def draw(results: dict[str, StudyResults], kept: Path) -> None:
    """Draw every figure, with its data, beside what is kept."""
    place = kept.parent
    moments.draw(results, kept, place)
    for figure in (
        figures.success,
        figures.ciao,
        figures.master,
        figures.held_out,
        figures.behaviours,
        figures.parity,
        figures.scripts,
    ):
        figure(results, place)
    parts = {"ablations": ("paper", "ablation"), "sensitivity": ("sensitivity",), "modern": ("combination", "modern")}
    for name, shown in parts.items():
        if any(found.setting.part in shown for found in results.values()):
            figures.forest(results, place, name, shown)


def made_by(missing: list[str]) -> str:
    """Return the command, the commit and the versions behind a page, and what is missing in it."""
    packages = ", ".join(f"{name} {version(name)}" for name in ("predprey-esp", "numpy", "numba"))
    command = " ".join(["python", "scripts/reproduce_paper.py", *sys.argv[1:]])
    names = ", ".join(f"`{name}`" for name in missing)
    left_out = f"**Not run whole yet, and not in this report: {names}.** " if names else ""
    return f"{left_out}`{command}` at commit {commit()}, {packages}"


if __name__ == "__main__":
    main()
