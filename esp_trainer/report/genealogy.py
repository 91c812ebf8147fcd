"""The genealogy of runs that kept it: curves of each side, and what they say in words."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from esp_trainer.analysis.genealogy import Genealogy
from esp_trainer.arrays import Curve, CurvesOfRuns
from esp_trainer.report.measure import MeasuredRuns
from esp_trainer.types import ROLES, Role
from predprey_env.settings import counted

_FEW = 0.1
"""Fraction of the founders below which they count as few."""


def founders(runs: Sequence[MeasuredRuns]) -> dict[Role, CurvesOfRuns]:
    """Return the effective number of founders by generation, ``(n_runs, n_generations)`` for each side."""
    return _curves(runs, lambda each: each.founders)


def from_past(runs: Sequence[MeasuredRuns]) -> dict[Role, CurvesOfRuns]:
    """Return the fraction of genes that came through a past champion; nothing if none did."""
    return _if_any(_curves(runs, lambda each: each.from_past))


def skipped(runs: Sequence[MeasuredRuns]) -> dict[Role, CurvesOfRuns]:
    """Return the fraction of generations that a gene skipped in past champions; nothing if none was skipped."""
    return _if_any(_curves(runs, lambda each: each.skipped / np.maximum(1, np.arange(len(each)))))


def of_founders(runs: Sequence[MeasuredRuns]) -> str:
    """Return the caption of the chart of founders."""
    size, last = runs[0].source.config.esp.subpopulation_size, _last(founders(runs))
    few = (
        "; few have taken over, and what is new comes from mutation"
        if max(last.values(), default=0) < _FEW * size
        else ""
    )
    return (
        f"Each subpopulation began with {size} neurons, the founders. This is how many of them have descendants at one "
        "place of the gene string (effective number, mean over places). In the end it is "
        f"{_both({role: f'{value:.1f}' for role, value in last.items()})}{few}."
    )


def of_past(runs: Sequence[MeasuredRuns]) -> str:
    """Return the caption of the chart of past champions."""
    n = len(runs[0].source) - 1
    bred = {role: counted(round(n * (1 - value)), "time") for role, value in _last(skipped(runs)).items()}
    return (
        "Some neurons mate with a past champion, which brings old genes back. Came back: the fraction of genes that "
        "did at least once. Skipped: the fraction of its generations that a gene skipped in this way. "
        f"In {counted(n, 'generation')} a gene was bred {_both(bred)}."
    )


def _both(values: Mapping[Role, str]) -> str:
    return " and ".join(f"{value} for the {role}" for role, value in values.items())


def _curves(runs: Sequence[MeasuredRuns], of: Callable[[Genealogy], Curve]) -> dict[Role, CurvesOfRuns]:
    kept = {role: [run.source.genealogies[role] for run in runs if role in run.source.genealogies] for role in ROLES}
    return {role: np.stack([of(each) for each in found]) for role, found in kept.items() if found}


def _if_any(curves: dict[Role, CurvesOfRuns]) -> dict[Role, CurvesOfRuns]:
    return curves if any(values.any() for values in curves.values()) else {}


def _last(curves: Mapping[Role, CurvesOfRuns]) -> dict[Role, float]:
    """Return the value of each side in the last generation, mean over runs."""
    return {role: float(values[:, -1].mean()) for role, values in curves.items()}
