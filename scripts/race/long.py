"""Runs of 10,000 generations: does the race go on, or does it end?"""

from __future__ import annotations

import json
from collections import Counter

import numpy as np
from study import table

from esp_trainer.types import ROLES
from race import endpoints
from race.measure import Arrays

CONDITION = "long"
PARTS = 5
"""Equal parts of a run whose means the table shows."""
WON = 0.05
"""A run is won if the champions catch less of their contemporaries' prey than this, or more than all but this."""


def tell(arrays: Arrays) -> str:
    """Return what became of the runs as Markdown."""
    ends = outcomes(arrays)
    told = ", ".join(f"{end} {n}" for end, n in Counter(ends).most_common())
    sides = [f"the {role} gain {endpoints.mean_gain(arrays, role, half=True)} against the panel" for role in ROLES]
    title = (
        f"**{arrays['caught'].shape[1]:,} generations** (`{CONDITION}`, {len(ends)} seeds of five, else `race`). By "
        f"the protocol's rules: {told}. In the second half {sides[0]}, and {sides[1]}. Means of fifths of each run:"
    )
    heads = ["seed", "the run", "caught of contemporaries", *(f"{role}, panel" for role in ROLES)]
    curves = [arrays["caught"].astype(float), *(endpoints.results(arrays, r, "panel").mean(axis=2) for r in ROLES)]
    rows = [
        [json.loads(str(config))["seed"], end, *(_course(curve[run]) for curve in curves)]
        for run, (config, end) in enumerate(zip(arrays["config"], ends, strict=True))
    ]
    return f"{title}\n\n{table(heads, rows)}"


def outcomes(arrays: Arrays) -> list[str]:
    """Return the protocol's word for each run: ``won by the prey``, ``won by the predators``, ``goes on`` or ``levels
    off``.
    """
    caught = arrays["caught"].astype(float)
    late = caught[:, -max(1, caught.shape[1] // 10) :].mean(axis=1)
    gains = np.stack([endpoints.gains(arrays, role, half=True).mean(axis=1) for role in ROLES])
    return [
        "won by the prey"
        if share < WON
        else "won by the predators"
        if share > 1 - WON
        else "goes on"
        if lesser > 0
        else "levels off"
        for share, lesser in zip(late, gains.min(axis=0), strict=True)
    ]


def _course(curve: np.ndarray) -> str:
    return " -> ".join(f"{part.mean():.2f}" for part in np.array_split(curve, PARTS))
