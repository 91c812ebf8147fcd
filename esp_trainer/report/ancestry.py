"""The chart of a champion's ancestry: by generation, the founder from which most genes of each neuron descend."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from esp_trainer.analysis.genealogy import Leading
from esp_trainer.arrays import NeuronIndices
from esp_trainer.report.measure import MeasuredRuns
from esp_trainer.types import Role
from predprey_env.settings import counted

FOUNDER_COLOURS = ("@0", "@1", "@2", "@3", "@4", "@5")
"""Colours of the founders that lead longest in a neuron; all others have :data:`OTHERS`."""
OTHERS = "@line"
COLUMNS = 300
"""Maximum number of generations that are drawn."""
_HOVER = (
    "generation %{x}, neuron %{y}<br>founder %{customdata[0]} gave %{customdata[1]}% of its genes<br>"
    "%{customdata[2]}% of its genes came through a past champion<extra></extra>"
)


def ancestry(runs: Sequence[MeasuredRuns], role: Role) -> dict[str, Any]:
    """Return the chart of one side, of the first run that kept its genealogy; without data if none did."""
    kept = [run.source for run in runs if role in run.source.genealogies]
    figure: dict[str, Any] = {"id": f"ancestry-{role}", "title": f"Ancestry of the champion {role}", "data": []}
    if not kept:
        return figure
    leading = kept[0].genealogies[role].leading()
    whose = f" Of {kept[0].name}." if len(runs) > 1 else ""
    return {
        **figure,
        "caption": f"{caption(leading)}{whose}",
        "data": [_heat_map(leading)],
        "layout": {
            "xaxis": {"title": {"text": "generation"}},
            "yaxis": {"title": {"text": "neuron"}, "autorange": "reversed"},
            "hovermode": "closest",
        },
    }


def caption(leading: Leading) -> str:
    """Return what the chart shows, how many founders still lead unchanged, and when the last takeover was."""
    changes = leading.takeovers()
    n_generations, n_neurons = leading.founder.shape
    since = 2 * n_generations // 3
    kept = n_neurons - int(changes[since:].any(axis=0).sum())
    changed = np.flatnonzero(changes.any(axis=1)) + 1
    last = f"; the last takeover is in generation {changed[-1]}" if len(changed) else ""
    return (
        "Each row is a neuron of the champion. Its colour is the founder from which most of its genes descend: blue "
        "leads longest in its row, then orange and so on; those that seldom lead are grey. Colours alternate while "
        "several founders last, and one stays where a founder has taken over: "
        f"{kept} of {counted(n_neurons, 'neuron')} kept theirs from generation {since} on{last}."
    )


def colours(founders: NeuronIndices) -> np.ndarray:
    """Return the colour of the leading founder of each neuron in each generation: its rank from 1, or 0 for others.

    In each neuron, founders are ranked by the number of generations in which they lead; ties go to the first to lead.

    Args:
        founders: Leading founders, int ``(T, S)``.

    Returns:
        Int ``(T, S)``.
    """
    found = np.zeros_like(founders)
    for neuron, leads in enumerate(founders.T):
        slots, first, times = np.unique(leads, return_index=True, return_counts=True)
        for rank, slot in enumerate(slots[np.lexsort((first, -times))][: len(FOUNDER_COLOURS)], start=1):
            found[leads == slot, neuron] = rank
    return found


def _heat_map(leading: Leading) -> dict[str, Any]:
    n = len(leading.founder)
    shown = np.unique(np.linspace(0, n - 1, COLUMNS).round().astype(int))
    percent = [np.round(100 * values).astype(int) for values in (leading.share, leading.from_past)]
    known = np.stack([leading.founder, *percent], axis=2)[shown]
    edges = np.linspace(0, 1, len(FOUNDER_COLOURS) + 2)
    scale = [[at, name] for i, name in enumerate((OTHERS, *FOUNDER_COLOURS)) for at in (edges[i], edges[i + 1])]
    return {
        "type": "heatmap",
        "x": shown.tolist(),
        "y": list(range(known.shape[1])),
        "z": colours(leading.founder)[shown].T.tolist(),
        "zmin": -0.5,
        "zmax": len(FOUNDER_COLOURS) + 0.5,
        "customdata": known.swapaxes(0, 1).tolist(),
        "colorscale": scale,
        "showscale": False,
        "showlegend": False,
        "hovertemplate": _HOVER,
    }
