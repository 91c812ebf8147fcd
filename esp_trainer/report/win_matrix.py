"""The win matrix of a report: the payoff of each pairing of generations, which the page draws."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from esp_trainer.report.measure import MeasuredRuns


def win_matrix(runs: Sequence[MeasuredRuns]) -> dict[str, Any] | None:
    """Return the payoff (fraction of prey caught) of each pairing, for each run; None without any cross-play.

    The page draws it as the CIAO plot of both sides (Cliff & Miller 1995).
    """
    played = [run.own for run in runs if run.own]
    if not played:
        return None
    top, bottom = float(max(own.payoff.max() for own in played)), float(min(own.payoff.min() for own in played))
    captures = runs[0].captures
    return {
        "matrices": [rounded(run.own.payoff) if run.own else None for run in runs],
        "predators": played[0].predators.tolist(),
        "prey": played[0].prey.tolist(),
        "n_starts": played[0].n_episodes,
        "top": max(0.5, top) if captures else top,
        "bottom": 0.0 if captures else bottom,
        "name": "prey caught" if captures else "payoff to the predators",
        "words": "of the prey caught" if captures else "to the predators",
    }


def rounded(values: np.ndarray) -> list[Any]:
    """Return the values as nested lists of 4 decimals, with None for nan, which JSON lacks."""
    numbers = np.round(values.astype(float), 4).astype(object)
    numbers[np.isnan(values)] = None
    return numbers.tolist()
