"""The pages of the studies of parts, from what is kept of their runs."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from race import endpoints
from race.measure import Arrays
from study import fill, table

from esp_trainer.analysis import plots
from esp_trainer.analysis.inference import compare, holm, summary
from esp_trainer.files import write_text
from esp_trainer.types import ROLES, Role

ALL = "all others"
_PANELS = {"held_out": "held out", "scripts": "scripts"}
_TITLES = {"3v1": "one prey", "steppe": "two prey"}
RunValues = dict[str, np.ndarray]
"""A value of each run, by condition."""


def write(template: Path, found: Mapping[str, Arrays], behaviours: Sequence[str], out: Path) -> None:
    """Write a page and its figure.

    Args:
        template: The page with fields to fill in; its name is that of the page.
        found: Measurements of all runs by task. The first condition is the one that others are compared with.
        behaviours: Behaviours to report.
        out: Directory of the page.
    """
    fields: dict[str, object] = defaultdict(lambda: None)
    fields["best"] = " ".join(_best(_TITLES[task], arrays) for task, arrays in found.items())
    for task, arrays in found.items():
        fields |= {f"{what}_{task}": text for what, text in _of_task(arrays, behaviours).items()}
    write_text(out / template.name, fill(template, fields))
    _draw(found, out / template.stem / "level.png")
    print(out / template.name)


def _of_task(arrays: Arrays, behaviours: Sequence[str]) -> dict[str, str]:
    levels = {f"{role}, {whom}": values for role in ROLES for whom, values in _levels(arrays, role).items()}
    shown = {name: _by_condition(arrays, endpoints.behaviour(arrays, name)) for name in behaviours}
    return {
        "levels": _means(levels),
        "differences": _differences(levels),
        "met": _met(arrays),
        "behaviours": _means(shown) if shown else "",
        "behaviour_differences": _differences(shown) if shown else "",
    }


def _best(task: str, arrays: Arrays) -> str:
    """Return which condition's sides do best against all others, and what the first condition's do."""
    sides = []
    for role, does in zip(ROLES, ("catch", "escape"), strict=True):
        means = {name: values.mean() for name, values in _by_condition(arrays, against_all(arrays, role)).items()}
        best, first = max(means, key=lambda name: means[name]), next(iter(means))
        compared = f"; `{first}`: {means[first]:.2f}" if best != first else ""
        sides.append(f"the {role} of `{best}` {does} most ({means[best]:.2f} of the prey{compared})")
    return f"Against all others with {task}, {' and '.join(sides)}."


def _by_condition(arrays: Arrays, values: np.ndarray) -> RunValues:
    conditions = arrays["condition"]
    return {str(name): values[conditions == name] for name in dict.fromkeys(conditions)}


def _levels(arrays: Arrays, role: Role) -> dict[str, RunValues]:
    """Return what each run's side reaches at its end, by opponents; higher is better."""
    found = {ALL: _by_condition(arrays, against_all(arrays, role))}
    for panel, words in _PANELS.items():
        found[words] = _by_condition(arrays, endpoints.level(arrays, role, panel))
    return found


def against_all(arrays: Arrays, role: Role) -> np.ndarray:
    """Return what each run's last champions reach against those of all other runs, float64 ``(n_runs,)``.

    Every condition counts alike, and a run's own opponents, which it evolved with, do not count.
    """
    conditions, caught = arrays["condition"], _of_others(arrays)
    reached = caught if role == "predators" else 1 - caught.T
    of_each = [np.nanmean(reached[:, conditions == name], axis=1) for name in dict.fromkeys(conditions)]
    return np.asarray(np.mean(of_each, axis=0))


def _of_others(arrays: Arrays) -> np.ndarray:
    """Return what each run's predators (rows) catch of each run's prey (columns), nan for its own."""
    return np.where(np.eye(len(arrays["met"]), dtype=bool), np.nan, arrays["met"])


def _means(columns: Mapping[str, RunValues]) -> str:
    names = next(iter(columns.values()))
    rows = [[f"`{name}`", *(summary(values[name]) for values in columns.values())] for name in names]
    return table(["", *columns], rows)


def _differences(columns: Mapping[str, RunValues]) -> str:
    """Return a table of what each condition has more than the first."""
    first, *others = next(iter(columns.values()))
    found = [[compare(values[name], values[first]) for values in columns.values()] for name in others]
    corrected = iter(holm([each.p for row in found for each in row]))
    rows = [
        [f"`{name}`", *(f"{e.interval}, p {next(corrected):.2g}" for e in row)]
        for name, row in zip(others, found, strict=True)
    ]
    return table([f"less `{first}`", *columns], rows)


def _met(arrays: Arrays) -> str:
    """Return a table of the fraction of prey that each condition's predators catch of each condition's prey."""
    conditions, caught = arrays["condition"], _of_others(arrays)
    names = list(dict.fromkeys(conditions))
    rows = [
        [f"`{mine}`", *(f"{np.nanmean(caught[np.ix_(conditions == mine, conditions == its)]):.2f}" for its in names)]
        for mine in names
    ]
    return table(["predators", *(f"`{name}`" for name in names)], rows)


def _draw(found: Mapping[str, Arrays], path: Path) -> None:
    """Draw levels against the held-out teams by generation: a row of panels for each task."""
    figure, axes = plots.panels(2 * len(found), width=4.6, columns=2)
    data: dict[str, np.ndarray] = {}
    panels = iter(axes)
    for task, arrays in found.items():
        generations = arrays["generations"][0]
        data["generation"] = generations
        for role in ROLES:
            panel = next(panels)
            curves = _by_condition(arrays, endpoints.results(arrays, role, "held_out").mean(axis=2))
            for number, (name, values) in enumerate(curves.items()):
                drawn = plots.curve(panel, generations, values, name, number)
                data |= {f"{task}, {role}, {name}: {part}": numbers for part, numbers in drawn.items()}
            panel.set(
                title=f"{_TITLES[task]}, {role}", xlabel="generation", ylabel="against held-out teams", ylim=(0, 1)
            )
    plots.legend_above(axes[0])
    plots.save(figure, path, data)
