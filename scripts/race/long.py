"""Runs of 10,000 generations: does the race go on, or does it end?"""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import numpy as np
from study import table

from esp_trainer.analysis import plots
from esp_trainer.types import ROLES
from race import endpoints
from race.measure import Arrays

CONDITION = "long"
PLANNED = 5
WINDOW = 100
"""Generations of the running means that are drawn."""
PARTS = 5
"""Equal parts of a run whose means the table shows."""
WON = 0.05
"""A run is won if the champions catch less of their contemporaries' prey than this, or more than all but this."""
_LUCK = "A run in which nothing changes would be said to go on about one time in four."


def tell(arrays: Arrays, figure: str) -> str:
    """Return what became of the runs as Markdown."""
    sides = [f"the {role} gain {endpoints.mean_gain(arrays, role, half=True)} against the panel" for role in ROLES]
    title = f"{in_short(arrays)} In the second half {sides[0]}, and {sides[1]}. {_LUCK} Means of fifths of each run:"
    heads = ["seed", "the run", "caught of contemporaries", *(f"{role}, panel" for role in ROLES)]
    curves = [arrays["caught"].astype(float), *(endpoints.results(arrays, r, "panel").mean(axis=2) for r in ROLES)]
    rows = [
        [seed, end, *(_course(curve[run]) for curve in curves)]
        for run, (seed, end) in enumerate(zip(_seeds(arrays), outcomes(arrays), strict=True))
    ]
    return f"{title}\n\n{table(heads, rows)}\n\n![Fraction of prey that champions catch, run by run]({figure})"


def in_short(arrays: Arrays) -> str:
    """Return how many runs ended in which way."""
    n_generations, n_runs = arrays["caught"].shape[1], len(arrays["config"])
    told = ", ".join(f"{end} {n}" for end, n in Counter(outcomes(arrays)).most_common())
    return (
        f"**{n_generations:,} generations** of `race-steppe` (`{CONDITION}`, {n_runs} seeds of the planned {PLANNED}) "
        f"end, by the protocol's rules, as: {told}. In the end {endpoints.told_level(arrays)}."
    )


def draw(arrays: Arrays, file: Path) -> None:
    """Draw the fraction of prey that the champions of each run catch of their contemporaries."""
    figure, (axes,) = plots.panels(1, width=9, height=2.7)
    data: dict[str, np.ndarray] = {"generation": np.arange(arrays["caught"].shape[1])}
    for number, (seed, caught) in enumerate(zip(_seeds(arrays), arrays["caught"].astype(float), strict=True)):
        data |= plots.curve(axes, data["generation"], caught[None], f"seed {seed}", number, window=WINDOW)
    axes.set(xlabel="generation", ylabel="fraction of prey caught", ylim=(0, 1))
    plots.legend_above(axes)
    plots.save(figure, file, {name: values[:: WINDOW // 2] for name, values in data.items()})


def _seeds(arrays: Arrays) -> list[int]:
    return [json.loads(str(config))["seed"] for config in arrays["config"]]


def outcomes(arrays: Arrays) -> list[str]:
    """Return the protocol's word for each run: ``won by the prey``, ``won by the predators``, ``goes on`` or ``levels
    off``.
    """
    caught = arrays["caught"].astype(float)
    late = caught[:, -max(1, caught.shape[1] // 10) :].mean(axis=1)
    lesser = np.minimum(*(endpoints.run_gains(arrays, role, half=True) for role in ROLES))
    rules = {"won by the prey": late < WON, "won by the predators": late > 1 - WON, "goes on": lesser > 0}
    return [str(word) for word in np.select(list(rules.values()), list(rules), "levels off")]


def _course(curve: np.ndarray) -> str:
    return " -> ".join(f"{part.mean():.2f}" for part in np.array_split(curve, PARTS))
