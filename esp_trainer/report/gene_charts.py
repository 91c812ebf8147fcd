"""The charts of the genes that a run selects from, and of what its selection sees."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import reduce
from typing import Any

import numpy as np

from esp_trainer.analysis.plots import smooth
from esp_trainer.arrays import Curve, CurvesOfRuns, TeamGenomes
from esp_trainer.report import genealogy
from esp_trainer.report.figure import COLOURS, Figure, axes, curve
from esp_trainer.report.measure import MeasuredRuns
from esp_trainer.report.source import SPREADS
from esp_trainer.report.verdict import WINDOW
from esp_trainer.types import ROLES, Role


def _both_roles(runs: Sequence[MeasuredRuns], name: str, window: int = 1) -> list[Any]:
    column, spreads = SPREADS.index(name), [run.source.spreads for run in runs]
    curves = {role: [each[role][:, column] for each in spreads if role in each] for role in ROLES}
    known = {role: [curve for curve in found if not np.isnan(curve).all()] for role, found in curves.items()}
    return _of_sides({role: smooth(np.stack(found), window) for role, found in known.items() if found})


def signal(runs: Sequence[MeasuredRuns]) -> Figure:
    """Return the chart of the signal of selection."""
    return {
        "id": "signal",
        "title": "What selection sees",
        "caption": "Fraction of the variance of neuron fitness within a subpopulation that is not sampling noise. "
        f"A few percent are usual; an estimate below 0 means that none was found. Means over {WINDOW} generations.",
        "data": _both_roles(runs, "signal", WINDOW),
        "layout": axes("fraction"),
    }


def diversity(runs: Sequence[MeasuredRuns]) -> Figure:
    """Return the chart of the diversity of the subpopulations."""
    return {
        "id": "diversity",
        "title": "Diversity of the subpopulations",
        "caption": "Standard deviation of a gene over the neurons of a subpopulation, mean over all.",
        "data": _both_roles(runs, "diversity"),
        "layout": axes("standard deviation", rangemode="tozero"),
    }


def founders(runs: Sequence[MeasuredRuns]) -> Figure:
    """Return the chart of the founders that are left, of a run that keeps its genealogy."""
    top = float(np.log10(runs[0].source.config.esp.subpopulation_size))
    return {
        "id": "founders",
        "title": "Founders left",
        "caption": genealogy.of_founders(runs),
        "data": _of_sides(genealogy.founders(runs)),
        "layout": axes("founders", type="log", dtick="D2", range=[0, top]),
    }


def past(runs: Sequence[MeasuredRuns]) -> Figure:
    """Return the chart of the genes that came back from past champions, of a run that keeps its genealogy."""
    return {
        "id": "past",
        "title": "From past champions",
        "caption": genealogy.of_past(runs),
        "data": _of_sides(genealogy.from_past(runs), ": came back")
        + _of_sides(genealogy.skipped(runs), ": skipped", 2),
        "layout": axes("fraction", range=[0, 1]),
    }


def _of_sides(curves: Mapping[Role, CurvesOfRuns], name: str = "", number: int = 0) -> list[Any]:
    """Return traces of curves ``(n_runs, n_generations)`` of each side."""
    data: list[Any] = []
    for role, values in curves.items():
        dash = number + ROLES.index(role)
        data += curve(np.arange(values.shape[1]), values, role + name, COLOURS[role], dash)
    return data


def weights(runs: Sequence[MeasuredRuns]) -> Figure:
    """Return the chart of the mean size of genes."""
    data = []
    for number, role in enumerate(ROLES):
        histories = [run.source.history for run in runs if run.source.history]
        evolved = [history for history in histories if role in history.champions]
        if evolved:
            kept = reduce(np.intersect1d, [history.kept for history in evolved])
            sizes = np.stack([_sizes(history.genomes(role, kept)) for history in evolved])
            data += curve(kept, sizes, f"{role}, champions", COLOURS[role], number)
    data += [{**trace, "opacity": 0.5 * trace.get("opacity", 1)} for trace in _named(_both_roles(runs, "scale"))]
    return {
        "id": "weights",
        "title": "Scale of the weights",
        "caption": "Mean size of a gene, in the champions and in all subpopulations.",
        "data": data,
        "layout": axes("mean size", rangemode="tozero"),
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
