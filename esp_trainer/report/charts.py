"""The charts of a report, as Plotly figures.

Plotly is used because it provides everything that these charts need without further code: values under the pointer,
clicks on cells, zoom, curves that the legend switches off, dark colours, PNG export, and phones. Its package contains
its script as one file, which is embedded whole in the page.

Colours are names in the page's palette (for example ``@predators``), because the page has a light and a dark palette.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import reduce
from typing import Any, TypeAlias

import numpy as np

from esp_trainer.analysis.inference import MIN_SEEDS, interval_of_curves
from esp_trainer.analysis.plots import smooth
from esp_trainer.analysis.progress import master_tournament
from esp_trainer.arrays import Curve, CurvesOfRuns, TeamGenomes
from esp_trainer.report import genealogy
from esp_trainer.report.ancestry import ancestry
from esp_trainer.report.measure import REPORTED_BEHAVIOURS, MeasuredRuns, appeared
from esp_trainer.report.source import SPREADS
from esp_trainer.report.verdict import WINDOW
from esp_trainer.report.win_matrix import rounded
from esp_trainer.types import ROLES, Role

Figure: TypeAlias = dict[str, Any]
"""A chart: ``id``, ``title``, ``caption``, and Plotly's ``data`` and ``layout``. ``click`` says what a click does, on
pages that can play matches."""

_FEW = 10
"""Maximum number of generations at which each has its tick on the axis."""

_DASHES = ("solid", "dash", "dashdot", "dot", "longdash", "longdashdot")
_COLOURS: dict[Role, str] = {"predators": "@attacker", "prey": "@prey"}  # as in the figures of the documents


def charts(runs: Sequence[MeasuredRuns]) -> list[Figure]:
    """Return all charts that have data."""
    drawn = [_success, _master, _others, _behaviours, _signal, _diversity, _founders, _past]
    found = [
        *(chart(runs) for chart in drawn),
        *(ancestry(runs, role) for role in ROLES),
        _weights(runs),
        _timings(runs),
    ]
    shown = [figure for figure in found if figure["data"]]
    n = len(runs[0].source)
    for figure in shown:  # all charts have the same range, so that they can be compared
        figure["layout"]["xaxis"]["range"] = [0, max(1, n - 1)]
        if n <= _FEW:
            figure["layout"]["xaxis"]["dtick"] = 1
    return shown


def _curve(x: np.ndarray, curves: CurvesOfRuns, name: str, colour: str, number: int = 0, **more: Any) -> list[Any]:
    """Return traces of the mean over runs, ``(n_runs, n)``, preceded by its 95% interval for three runs or more."""
    mean, low, high = interval_of_curves(curves)
    line = {"color": colour, "dash": _DASHES[number % len(_DASHES)], "width": 2}
    mode = "lines" if len(x) > 1 else "lines+markers"
    curve = {"x": x.tolist(), "y": rounded(mean), "name": name, "mode": mode, "line": line, "legendgroup": name}
    curve |= {"hovertemplate": f"%{{y:.3f}}<extra>{name}</extra>"} | more
    if len(curves) < MIN_SEEDS:
        return [curve]
    band = {
        "x": [*x.tolist(), *x[::-1].tolist()],
        "y": rounded(np.concatenate([high, low[::-1]])),
        "fill": "toself",
        "fillcolor": colour,
        "opacity": 0.2,
        "line": {"width": 0},
        "hoverinfo": "skip",
        "showlegend": False,
        "legendgroup": name,
    }
    return [band | more, curve]


def _axes(y: str, **more: Any) -> dict[str, Any]:
    """Return a layout with generations on the horizontal axis; ``more`` are options of the vertical axis."""
    return {"xaxis": {"title": {"text": "generation"}}, "yaxis": {"title": {"text": y}, **more}}


def _labels(runs: Sequence[MeasuredRuns]) -> tuple[str, str]:
    """Return the names of the results of both sides."""
    return ("predators: prey caught", "prey: not caught") if runs[0].captures else ("predators", "prey")


def _results(runs: Sequence[MeasuredRuns]) -> dict[str, Any]:
    """Return the layout of a chart of both sides' results."""
    return _axes("mean result", range=[0, 1]) if runs[0].captures else _axes("mean payoff to each side")


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
            data += _curve(np.arange(values.shape[1]), values, name, colour, number)
    layout = _axes("fraction", range=[0, 1]) if runs[0].captures else _axes("payoff")
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
        data += _curve(
            played[0].predators,
            np.stack([each.predators for each in both]),
            ours,
            _COLOURS["predators"],
        )
        data += _curve(played[0].prey, np.stack([each.prey for each in both]), theirs, _COLOURS["prey"], 1)
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
        data += _curve(rows, np.stack([m.predators.curve for _, m in met]), ours, _COLOURS["predators"])
        data += _curve(rows, np.stack([m.prey.curve for _, m in met]), theirs, _COLOURS["prey"], 1)
    return {
        "id": "others",
        "title": "Against opponents of other seeds",
        "caption": "Champions of other runs, which this run never met: progress here is no mere answer to its own "
        "opponents.",
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
        data += _curve(watched[0].generations, rates, name, f"@{number % 7}", number // 2, **rare)
    return {
        "id": "behaviours",
        "title": "Behaviours",
        "caption": "Fraction of the episodes of champions against contemporary champions in which a behaviour is "
        "detected, minus its rate by chance. The legend switches on the rare ones.",
        "data": data,
        "layout": _axes("rate beyond chance"),
    }


def _both_roles(runs: Sequence[MeasuredRuns], name: str, window: int = 1) -> list[Any]:
    column, spreads = SPREADS.index(name), [run.source.spreads for run in runs]
    curves = {role: [each[role][:, column] for each in spreads if role in each] for role in ROLES}
    known = {role: [curve for curve in found if not np.isnan(curve).all()] for role, found in curves.items()}
    return _of_sides({role: smooth(np.stack(found), window) for role, found in known.items() if found})


def _signal(runs: Sequence[MeasuredRuns]) -> Figure:
    return {
        "id": "signal",
        "title": "What selection sees",
        "caption": "Fraction of the variance of neuron fitness within a subpopulation that is not sampling noise. "
        f"A few percent are usual; an estimate below 0 means that none was found. Means over {WINDOW} generations.",
        "data": _both_roles(runs, "signal", WINDOW),
        "layout": _axes("fraction"),
    }


def _diversity(runs: Sequence[MeasuredRuns]) -> Figure:
    return {
        "id": "diversity",
        "title": "Diversity of the subpopulations",
        "caption": "Standard deviation of a gene over the neurons of a subpopulation, mean over all.",
        "data": _both_roles(runs, "diversity"),
        "layout": _axes("standard deviation", rangemode="tozero"),
    }


def _founders(runs: Sequence[MeasuredRuns]) -> Figure:
    top = float(np.log10(runs[0].source.config.esp.subpopulation_size))
    return {
        "id": "founders",
        "title": "Founders left",
        "caption": genealogy.of_founders(runs),
        "data": _of_sides(genealogy.founders(runs)),
        "layout": _axes("founders", type="log", dtick="D2", range=[0, top]),
    }


def _past(runs: Sequence[MeasuredRuns]) -> Figure:
    return {
        "id": "past",
        "title": "From past champions",
        "caption": genealogy.of_past(runs),
        "data": _of_sides(genealogy.from_past(runs), ": came back")
        + _of_sides(genealogy.skipped(runs), ": skipped", 2),
        "layout": _axes("fraction", range=[0, 1]),
    }


def _of_sides(curves: Mapping[Role, CurvesOfRuns], name: str = "", number: int = 0) -> list[Any]:
    """Return traces of curves ``(n_runs, n_generations)`` of each side."""
    data: list[Any] = []
    for role, values in curves.items():
        dash = number + ROLES.index(role)
        data += _curve(np.arange(values.shape[1]), values, role + name, _COLOURS[role], dash)
    return data


def _weights(runs: Sequence[MeasuredRuns]) -> Figure:
    data = []
    for number, role in enumerate(ROLES):
        histories = [run.source.history for run in runs if run.source.history]
        evolved = [history for history in histories if role in history.champions]
        if evolved:
            kept = reduce(np.intersect1d, [history.kept for history in evolved])
            sizes = np.stack([_sizes(history.genomes(role, kept)) for history in evolved])
            data += _curve(kept, sizes, f"{role}, champions", _COLOURS[role], number)
    data += [{**trace, "opacity": 0.5 * trace.get("opacity", 1)} for trace in _named(_both_roles(runs, "scale"))]
    return {
        "id": "weights",
        "title": "Scale of the weights",
        "caption": "Mean size of a gene, in the champions and in all subpopulations.",
        "data": data,
        "layout": _axes("mean size", rangemode="tozero"),
    }


def _named(traces: list[Any]) -> list[Any]:
    """Return traces with ", all" added to their names, to tell whole subpopulations from champions."""
    return [
        {**trace, "legendgroup": f"{trace['legendgroup']}, all", "name": f"{trace.get('name', '')}, all"}
        for trace in traces
    ]


def _sizes(champions: TeamGenomes) -> Curve:
    """Return the mean absolute value of each champion's genes, without those that no network reads (which are 0)."""
    genes = np.abs(champions).reshape(len(champions), -1)
    return np.asarray(genes.sum(axis=1) / np.maximum(1, (genes != 0).sum(axis=1)), float)


def _timings(runs: Sequence[MeasuredRuns]) -> Figure:
    data = []
    timed = [run.source.seconds for run in runs if run.source.seconds]
    for number, phase in enumerate(timed[0] if timed else ()):
        values = 1000 * np.stack([smooth(each[phase], WINDOW) for each in timed if phase in each])
        (curve,) = _curve(
            np.arange(values.shape[1]), values.mean(axis=0)[None], phase.replace("_", " "), f"@{number % 7}"
        )
        data.append({**curve, "stackgroup": "all", "hovertemplate": f"%{{y:.2f}} ms<extra>{curve['name']}</extra>"})
    return {
        "id": "timings",
        "title": "Time",
        "caption": f"Wall time of a generation by phase, means over {WINDOW} generations.",
        "data": data,
        "layout": _axes("milliseconds", rangemode="tozero"),
    }
