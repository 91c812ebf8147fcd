"""The charts of a report, as Plotly figures.

Plotly is used because it provides everything that these charts need without further code: values under the pointer,
clicks on cells, zoom, curves that the legend switches off, dark colours, PNG export, and phones. Its package contains
its script as one file, which is embedded whole in the page.

Colours are names in the page's palette (for example ``@predators``), because the page has a light and a dark palette.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from esp_trainer.analysis.plots import smooth
from esp_trainer.analysis.progress import master_tournament
from esp_trainer.report import gene_charts
from esp_trainer.report.ancestry import ancestry
from esp_trainer.report.figure import COLOURS, Figure, axes, curve
from esp_trainer.report.measure import REPORTED_BEHAVIOURS, MeasuredRuns, appeared
from esp_trainer.report.verdict import WINDOW
from esp_trainer.types import ROLES

_FEW = 10
"""Maximum number of generations at which each has its tick on the axis."""

_EXPLOITERS = 3
"""Exploiters of a running mean."""


def charts(runs: Sequence[MeasuredRuns]) -> list[Figure]:
    """Return all charts that have data."""
    drawn = [_success, _master, _others, _exploiters, _behaviours]
    drawn += [gene_charts.signal, gene_charts.diversity, gene_charts.founders, gene_charts.past]
    found = [
        *(chart(runs) for chart in drawn),
        *(ancestry(runs, role) for role in ROLES),
        gene_charts.weights(runs),
        _timings(runs),
    ]
    shown = [figure for figure in found if figure["data"]]
    n = len(runs[0].source)
    for figure in shown:  # all charts have the same range, so that they can be compared
        figure["layout"]["xaxis"]["range"] = [0, max(1, n - 1)]
        if n <= _FEW:
            figure["layout"]["xaxis"]["dtick"] = 1
    return shown


def _labels(runs: Sequence[MeasuredRuns]) -> tuple[str, str]:
    """Return the names of the results of both sides."""
    return ("predators: prey caught", "prey: not caught") if runs[0].captures else ("predators", "prey")


def _results(runs: Sequence[MeasuredRuns]) -> dict[str, Any]:
    """Return the layout of a chart of both sides' results."""
    return axes("mean result", range=[0, 1]) if runs[0].captures else axes("mean payoff to each side")


def _success(runs: Sequence[MeasuredRuns]) -> Figure:
    curves = [run.source.curves for run in runs if run.source.curves]
    data: list[Any] = []
    kinds = {
        "caught": ("prey caught", "@ink"),
        "all_caught": ("all prey caught: predators succeed", "@attacker"),
        "none_caught": ("none caught: prey succeed", "@prey"),
    }
    if not runs[0].captures:
        kinds = {"payoff": ("payoff to the predators", "@ink")}
    elif runs[0].source.config.env.n_prey == 1:
        del kinds["all_caught"]  # the same as the fraction of prey caught
    for number, (kind, (name, colour)) in enumerate(kinds.items()):
        if curves:
            values = smooth(np.stack([each[kind] for each in curves]), WINDOW)
            data += curve(np.arange(values.shape[1]), values, name, colour, number)
    layout = axes("fraction", range=[0, 1]) if runs[0].captures else axes("payoff")
    phases = runs[0].phases if len(runs) == 1 else ()
    edge = {"type": "line", "yref": "paper", "y0": 0, "y1": 1, "line": {"color": "@muted", "width": 1, "dash": "dot"}}
    layout["shapes"] = [{**edge, "x0": phase.start, "x1": phase.start} for phase in phases[1:]]
    changes = " Dotted lines are where a phase begins." if len(phases) > 1 else ""
    return {
        "id": "success",
        "title": "Success, champion against champion",
        "caption": f"Means over {WINDOW} generations, from held-out starts.{changes} The opponent changes too, so "
        "this cannot show who became better.",
        "data": data,
        "layout": layout,
    }


def _master(runs: Sequence[MeasuredRuns]) -> Figure:
    played = [run.own for run in runs if run.own and run.progress]
    data: list[Any] = []
    if played:
        both = [master_tournament(own.payoff, own.total) for own in played]
        ours, theirs = _labels(runs)
        data += curve(
            played[0].predators,
            np.stack([each.predators for each in both]),
            ours,
            COLOURS["predators"],
        )
        data += curve(played[0].prey, np.stack([each.prey for each in both]), theirs, COLOURS["prey"], 1)
    return {
        "id": "master",
        "title": "Master tournament",
        "caption": "Each generation against all opponents of its run (Nolfi & Floreano 1998): a curve that rises is "
        "progress.",
        "click": "A click on a point plays that generation against the last of the other side.",
        "data": data,
        "layout": _results(runs),
    }


def _others(runs: Sequence[MeasuredRuns]) -> Figure:
    met = [(run.own, run.met_others) for run in runs if run.own and run.met_others]
    data: list[Any] = []
    if met:
        rows = met[0][0].predators
        ours, theirs = _labels(runs)
        data += curve(rows, np.stack([m.predators.curve for _, m in met]), ours, COLOURS["predators"])
        data += curve(rows, np.stack([m.prey.curve for _, m in met]), theirs, COLOURS["prey"], 1)
    return {
        "id": "others",
        "title": "Against opponents of other seeds",
        "caption": "Champions of other runs, which this run never met: progress here is no mere answer to its own "
        "opponents.",
        "data": data,
        "layout": _results(runs),
    }


def _exploiters(runs: Sequence[MeasuredRuns]) -> Figure:
    found = [run.source.exploiters for run in runs if run.source.exploiters]
    data: list[Any] = []
    for number, (role, label) in enumerate(zip(ROLES, _labels(runs), strict=True) if found else ()):
        reached = smooth(np.stack([each.reached[role] for each in found]), _EXPLOITERS)
        data += curve(found[0].generations, reached, label.replace(role, f"exploiting {role}"), COLOURS[role], number)
    generations = runs[0].source.config.esp.exploiter_generations
    return {
        "id": "exploiters",
        "title": "Exploiters against the champions",
        "caption": f"What fresh populations reach in {generations} generations of evolution against the champion "
        f"alone: where a curve falls, champions become harder to learn against. Means over {_EXPLOITERS} of them.",
        "data": data,
        "layout": _results(runs),
    }


def _behaviours(runs: Sequence[MeasuredRuns]) -> Figure:
    watched = [run.watched for run in runs if run.watched]
    data: list[Any] = []
    for number, name in enumerate(REPORTED_BEHAVIOURS):
        rates = np.array([each.excess(name) for each in watched])
        if not rates.size or np.isnan(rates).any():
            continue
        rare = {} if appeared(watched, name) else {"visible": "legendonly"}
        data += curve(watched[0].generations, rates, name, f"@{number % 7}", number // 2, **rare)
    return {
        "id": "behaviours",
        "title": "Behaviours",
        "caption": "Fraction of the episodes of champions against contemporary champions in which a behaviour is "
        "detected, minus its rate by chance. The legend switches on the rare ones.",
        "data": data,
        "layout": axes("rate beyond chance"),
    }


def _timings(runs: Sequence[MeasuredRuns]) -> Figure:
    data = []
    timed = [run.source.seconds for run in runs if run.source.seconds]
    for number, phase in enumerate(timed[0] if timed else ()):
        values = 1000 * np.stack([smooth(each[phase], WINDOW) for each in timed if phase in each])
        (trace,) = curve(
            np.arange(values.shape[1]), values.mean(axis=0)[None], phase.replace("_", " "), f"@{number % 7}"
        )
        data.append({**trace, "stackgroup": "all", "hovertemplate": f"%{{y:.2f}} ms<extra>{trace['name']}</extra>"})
    return {
        "id": "timings",
        "title": "Time",
        "caption": f"Wall time of a generation by phase, means over {WINDOW} generations.",
        "data": data,
        "layout": axes("milliseconds", rangemode="tozero"),
    }
