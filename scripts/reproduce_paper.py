"""The paper's experiments over many seeds, from nothing to ``docs/reproduction.md``.

Runs every setting of ``reproduction/arms.py``, measures each run, and writes the report with its figures and their
data. It can be stopped at any moment and started again: what is finished is not done again. The whole takes some hours
on two cores; ``--quick`` does all of it in small, in a minute, to see that it works (its figures mean nothing).

    python scripts/reproduce_paper.py              # into docs/
    python scripts/reproduce_paper.py --report     # only the report and figures again, from the data that is kept
    python scripts/reproduce_paper.py --quick      # into runs/quick
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # workers of the pools import it too

from reproduction import figures, moments, paper, report
from reproduction.arms import ARMS, Arm, small, world_of
from reproduction.claims import verdicts
from reproduction.evolve import evolve
from reproduction.measure import measure
from reproduction.results import Results, gather, load

from esp_trainer.cores import cores


def main() -> None:
    """Do what is still to do."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="small and meaningless, to see that it works")
    parser.add_argument("--report", action="store_true", help="run nothing")
    parser.add_argument("--runs", type=Path, help="where runs are kept; by default runs/reproduction, or runs/quick")
    parser.add_argument("--out", type=Path, help="where the report goes; by default docs, or runs/quick")
    parser.add_argument("--workers", type=int, default=cores(), help="processes; by default one a core")
    options = parser.parse_args()
    options.runs = options.runs or Path("runs/quick" if options.quick else "runs/reproduction")
    options.out = options.out or Path("runs/quick" if options.quick else "docs")
    arms = small(ARMS) if options.quick else ARMS
    kept = options.out / "reproduction" / "data"
    panels = [arm for arm in arms.values() if arm.part == "panel"]
    reported = [arm for arm in arms.values() if arm.part != "panel"]
    if not options.report:
        run([arm for arm in reported if load(kept, arm) is None], panels, options.runs, kept, options.workers)
    found = {arm.name: load(kept, arm) for arm in reported}
    results = {name: each for name, each in found.items() if each is not None}
    if not results:
        parser.error(f"there is nothing to report on in {kept}")
    if not options.report:
        moments.find(options.runs, results, kept)
    draw(results, kept)
    missing = tuple(name for name, each in found.items() if each is None)
    found_claims, made_by = verdicts(paper.CLAIMS, results), origin(missing)
    (options.out / "reproduction.md").write_text(report.write(results, found_claims, made_by))
    supplement = report.write_supplement(results, found_claims, made_by)
    (options.out / "reproduction" / "supplement.md").write_text(supplement)
    print(f"{options.out / 'reproduction.md'}: {len(results)} of {len(found)} settings")


def run(arms: list[Arm], panels: list[Arm], runs: Path, kept: Path, workers: int) -> None:
    """Evolve and measure these arms, first the panels that they are measured against."""
    if arms:
        worlds = {world_of(arm.config) for arm in arms}
        panels = [panel for panel in panels if world_of(panel.config) in worlds]
        evolve(runs, [*panels, *arms], workers)
        measure(runs, arms, panels, workers)
    for arm in arms:
        gather(runs, kept, arm)


def draw(results: dict[str, Results], kept: Path) -> None:
    """Every figure, with its data, beside what is kept."""
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
    figures.forest(results, place, "ablations", ("paper", "ablation"))
    for name, parts in {"sensitivity": ("sensitivity",), "modern": ("combination", "modern")}.items():
        if any(found.arm.part in parts for found in results.values()):
            figures.forest(results, place, name, parts)


def origin(missing: tuple[str, ...]) -> report.Origin:
    """The command and the versions behind a report."""
    try:
        commit = subprocess.check_output(["git", "rev-parse", "--short", "HEAD"], text=True).strip()
    except (OSError, subprocess.CalledProcessError):  # no git, or no repository
        commit = "unknown"
    packages = ", ".join(f"{name} {version(name)}" for name in ("predprey-esp", "numpy", "numba"))
    command = " ".join(["python", "scripts/reproduce_paper.py", *sys.argv[1:]])
    return report.Origin(command, commit, packages, missing)


if __name__ == "__main__":
    main()
