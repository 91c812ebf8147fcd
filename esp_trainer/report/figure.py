"""The parts that all charts of a report are made of: Plotly figures, and curves with their intervals."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np

from esp_trainer.analysis.inference import MIN_SEEDS, interval_of_curves
from esp_trainer.arrays import CurvesOfRuns
from esp_trainer.report.win_matrix import rounded
from esp_trainer.types import Role

Figure: TypeAlias = dict[str, Any]
"""A chart: ``id``, ``title``, ``caption``, and Plotly's ``data`` and ``layout``. ``click`` says what a click does, on
pages that can play matches."""

_DASHES = ("solid", "dash", "dashdot", "dot", "longdash", "longdashdot")
COLOURS: dict[Role, str] = {"predators": "@attacker", "prey": "@prey"}  # as in the figures of the documents


def curve(x: np.ndarray, curves: CurvesOfRuns, name: str, colour: str, number: int = 0, **more: Any) -> list[Any]:
    """Return traces of the mean over runs, ``(n_runs, n)``, preceded by its 95% interval for three runs or more."""
    mean, low, high = interval_of_curves(curves)
    line = {"color": colour, "dash": _DASHES[number % len(_DASHES)], "width": 2}
    mode = "lines" if len(x) > 1 else "lines+markers"
    drawn = {"x": x.tolist(), "y": rounded(mean), "name": name, "mode": mode, "line": line, "legendgroup": name}
    drawn |= {"hovertemplate": f"%{{y:.3f}}<extra>{name}</extra>"} | more
    if len(curves) < MIN_SEEDS:
        return [drawn]
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
    return [band | more, drawn]


def axes(y: str, **more: Any) -> dict[str, Any]:
    """Return a layout with generations on the horizontal axis; ``more`` are options of the vertical axis."""
    return {"xaxis": {"title": {"text": "generation"}}, "yaxis": {"title": {"text": y}, **more}}
