"""``compare``: comparison of conditions with several seeds each, on the terminal and as a page."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from esp_trainer.analysis.comparison import (
    HELD_OUT,
    LEAST,
    SCRIPTED,
    Condition,
    MeasuredRun,
    Panel,
    held_out_opponents,
    measure_history,
    measures,
    script_panel,
)
from esp_trainer.analysis.conditions import check_same_world, conditions
from esp_trainer.analysis.history import History
from esp_trainer.analysis.pooling import check_directories, check_same_config, note_on_champions, note_on_lengths
from esp_trainer.cli.report import place_of_page, read_all
from esp_trainer.cli.streams import say
from esp_trainer.evaluation.registry import make_evaluator
from esp_trainer.files import check_place, write_table, write_text
from esp_trainer.report.comparison import comparison_page
from esp_trainer.report.comparison_tables import answer, compared, notes_on, on_terminal, tables
from esp_trainer.report.source import SPREADS, RunSource, cut
from esp_trainer.run.directory import RunDirectory
from esp_trainer.sweep.plan import read_plan
from esp_trainer.teams.zoo import unknown
from esp_trainer.types import Evaluator


@dataclass(frozen=True)
class CompareOptions:
    """Settings of a comparison."""

    generations: int
    """Number of generations of each run that meet the panels."""
    episodes: int
    """Number of episodes per pair of teams."""
    against: str | None = None
    """Name of the baseline, with which the other conditions are compared; by default the first condition."""


def compare(
    runs: Sequence[Path], panel: Sequence[Path], out: Path | None, csv: Path | None, settings: CompareOptions
) -> int:
    """Measure all runs against the same opponents, print the tables, and write the page."""
    named = runs_in(runs)
    sources, others, notes = _read(list(named), list(runs_in(panel)))
    by_condition, more = _by_condition(sources, [named[source.path] for source in sources], settings)
    baseline = _baseline(list(by_condition), settings.against)
    place = place_of_page(runs, out, "compare.html")
    _check_places(place, csv)
    config = sources[0].config
    env = None if config.game.environment else config.env
    panels = {HELD_OUT: held_out_opponents(env, others), SCRIPTED: script_panel(another_game=env is None)}
    measured = _measure(by_condition, panels, make_evaluator(config), settings)
    against = next(each for each in measured if each.name == baseline)
    differences = compared(measured, against)
    found, verdict = tables(measured, against, differences), answer(differences, against)
    notes += [*more, *notes_on(measured, against)]
    title = "Comparison of " + (runs[0].resolve().name if len(runs) == 1 else f"{len(sources)} runs")
    html = comparison_page(title, verdict, measured, found, notes)
    if csv:
        _write(csv, by_condition, measured)
    write_text(place, html)
    print("\n\n".join("\n".join(on_terminal(table)) for table in found))
    for note in notes:
        say(f"note: {note}")
    if verdict:
        print(f"\n{verdict}")
    print(f"open {place} in a browser ({place.stat().st_size / 1e6:.1f} MB)")
    return 0


def runs_in(places: Sequence[Path]) -> dict[Path, str | None]:
    """Return the runs in some directories, and the name of each run's condition if its sweep's file gives it one.

    A directory that is not a run but contains runs stands for all of these. They are in the order of the sweep's file
    if it is the directory of a sweep, else sorted by name.

    Raises:
        ValueError: A run is given twice.
    """
    found: list[tuple[Path, str | None]] = []
    for place in places:
        inside = _inside(place) if place.is_dir() and not _is_run(place) else []
        found += inside or [(place, None)]
    check_directories([path for path, _ in found])
    return dict(found)


def _inside(place: Path) -> list[tuple[Path, str | None]]:
    paths = sorted(filter(_is_run, place.iterdir()), key=_by_numbers)
    file = place / "sweep.toml"
    planned = {run.name: run for run in read_plan(file)} if file.exists() else {}
    order = {name: i for i, name in enumerate(planned)}
    paths.sort(key=lambda path: order.get(path.name, len(order)))
    names = {name: run.cell for name, run in planned.items() if run.named}
    return [(path, names.get(path.name)) for path in paths]


def _is_run(place: Path) -> bool:
    return RunDirectory(place).config_file.exists()


def _by_numbers(path: Path) -> list[tuple[float, str]]:
    """Return a sort key that compares numbers in a name by value, so that seed 10 comes after seed 9."""
    parts = re.findall(r"(\d+(?:\.\d+)?)|(\D+)", path.name)
    return [(float(number) if number else -1.0, text) for number, text in parts]


def _check_places(place: Path, csv: Path | None) -> None:
    if csv:
        if csv.resolve() == place.resolve():
            raise ValueError(f"--csv and --out must be different files, got {csv}")
        check_place(csv)
    check_place(place)


def _read(runs: Sequence[Path], panel: Sequence[Path]) -> tuple[list[RunSource], list[History], list[str]]:
    """Return the complete runs, the runs of the panel, and a note on each run that is left out.

    Raises:
        ValueError: Not all runs have the same world.
    """
    check_directories([*runs, *panel])
    sources, notes = _finished(runs)
    others = [History.of_run(path) for path in panel]
    configs = [(source.path, source.config) for source in sources]
    check_same_world([*configs, *((path, other.config) for path, other in zip(panel, others, strict=True))])
    return sources, others, notes


def _finished(runs: Sequence[Path]) -> tuple[list[RunSource], list[str]]:
    """Return the complete runs, and a note on each other run; raise the first note as an error if none is complete."""
    sources, notes = read_all(runs)
    whole = []
    for source in sources:
        if not source.history:
            notes.append(f"Left out: {'; '.join([f'{source.path} has no champions', *source.missing])}.")
        elif len(source) < source.config.generations:
            so_far = f"{source.path} has {len(source)} of its {source.config.generations} generations"
            notes.append(f"Left out: {'; '.join([so_far, *source.missing])}.")
        else:
            whole.append(source)
    if not whole:
        raise ValueError(f"no run is complete: {notes[0].removeprefix('Left out: ').rstrip('.')}")
    return whole, notes


def _by_condition(
    sources: Sequence[RunSource], given: Sequence[str | None], settings: CompareOptions
) -> tuple[dict[str, list[RunSource]], list[str]]:
    """Return the runs of each condition, cut to common generations, and notes on what was cut."""
    found, notes = {}, []
    for name, indices in conditions([source.config for source in sources], given).items():
        runs = [sources[i] for i in indices]
        check_same_config([(run.path, run.config) for run in runs])
        histories = [run.history for run in runs if run.history]
        said = [note_on_lengths([len(run) for run in runs]), note_on_champions(histories)]
        notes += [f"{name}: {note}" for note in said if note]
        found[name] = cut(runs)
        sampled = len(_history(found[name][0]).sample(settings.generations))
        if sampled < LEAST:
            raise ValueError(f"progress takes at least {LEAST} generations, got {sampled} of {name}")
    return found, notes


def _history(source: RunSource) -> History:
    assert source.history  # _finished leaves out runs without a history
    return source.history


def _baseline(names: Sequence[str], wanted: str | None) -> str:
    if wanted is None:
        return names[0]
    if wanted not in names:
        raise ValueError(unknown("condition", wanted, names))
    return wanted


def _measure(
    by_condition: dict[str, list[RunSource]],
    panels: dict[str, Panel],
    evaluator: Evaluator,
    settings: CompareOptions,
) -> list[Condition]:
    def measured(source: RunSource) -> MeasuredRun:
        say(f"playing {source.path} ...")
        n_generations, n_episodes = settings.generations, settings.episodes
        found = measure_history(_history(source), panels, evaluator, n_generations=n_generations, n_episodes=n_episodes)
        return replace(found, values=found.values | _signals(source))

    return [Condition(name, [measured(source) for source in sources]) for name, sources in by_condition.items()]


def _signals(source: RunSource) -> dict[str, float]:
    """Return the mean signal of selection of each side, over the generations whose log has it."""
    column = SPREADS.index("signal")
    told = {role: spreads[:, column][~np.isnan(spreads[:, column])] for role, spreads in source.spreads.items()}
    return {f"{role}_signal": float(values.mean()) for role, values in told.items() if len(values)}


def _write(file: Path, by_condition: dict[str, list[RunSource]], measured: Sequence[Condition]) -> None:
    """Write a CSV file with a line for each run. Unknown values are left empty."""
    names = measures(captures=measured[0].runs[0].captures)
    lines: list[list[object]] = [["run", "condition", "seed", "generations", *names]]
    for condition in measured:
        for source, run in zip(by_condition[condition.name], condition.runs, strict=True):
            values = [f"{run.values[name]:.6g}" if not np.isnan(run.values[name]) else "" for name in names]
            lines.append([source.path, condition.name, source.config.seed, len(source), *values])
    write_table(file, lines)
