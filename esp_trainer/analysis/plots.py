"""Figures of an arms race in a common style. Each figure is saved together with its data.

Colours are those of Okabe & Ito, which colour-blind readers can tell apart, and lines also differ in their dashes.
Matrices use viridis, which stays readable when printed in grey.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from esp_trainer.analysis.inference import MIN_SEEDS, interval_of_curves
from esp_trainer.arrays import Cells, Curve, CurvesOfRuns, GenerationIndices, PayoffMatrix
from esp_trainer.files import write, write_table

PREDATORS, PREY = "#d55e00", "#0072b2"
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
_DASHES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (8, 2)), (0, (1, 1)))
_STYLE = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "figure.dpi": 120,
    "savefig.dpi": 160,
    "lines.linewidth": 1.4,
    "svg.hashsalt": "predprey-esp",
}

Table = Mapping[str, Sequence[object] | np.ndarray]
"""Columns of equal length, by name."""


def panels(n: int, width: float = 3.6, height: float = 2.7, columns: int = 3) -> tuple[Figure, list[Axes]]:
    """Create a figure with ``n`` panels of ``width`` by ``height`` inches, in rows of at most ``columns`` panels."""
    n_columns = min(n, columns)
    n_rows = -(-n // n_columns)
    with matplotlib.rc_context(_STYLE):
        figure = Figure(figsize=(width * n_columns, height * n_rows), layout="constrained")
        axes = list(figure.subplots(n_rows, n_columns, squeeze=False).flat)
    for spare in axes[n:]:
        spare.remove()
    return figure, axes[:n]


def legend(axes: Axes, **where: str) -> None:
    """Add a legend, half transparent so that it hides little of the data."""
    axes.legend(frameon=True, framealpha=0.6, edgecolor="none", fontsize=8, **where)


def legend_above(axes: Axes) -> None:
    """Add the legend of one panel above all panels of its figure, where it hides no curve."""
    figure = axes.get_figure(root=True)
    assert figure is not None
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels), frameon=False, fontsize=8)


def save(figure: Figure, path: Path, data: Table) -> None:
    """Write a figure, and its data as a CSV file of the same name."""
    path.parent.mkdir(parents=True, exist_ok=True)
    picture = BytesIO()
    with matplotlib.rc_context(_STYLE):
        figure.savefig(picture, format=path.suffix[1:], metadata={"Software": None} if path.suffix == ".png" else None)
    write(path, picture.getvalue())
    rows = zip(*data.values(), strict=True)
    cells = ([f"{value:.6g}" if isinstance(value, float) else value for value in row] for row in rows)
    write_table(path.with_suffix(".csv"), [data, *cells])


def as_svg(figure: Figure, name: str) -> str:
    """Return a figure as an SVG element for a page, with text as text and a transparent background.

    Args:
        figure: The figure.
        name: Prefix of the ids in the SVG, which must be unique on the page.
    """
    picture = BytesIO()
    nothing = dict.fromkeys(("Creator", "Date", "Format", "Type"))
    with matplotlib.rc_context({**_STYLE, "svg.fonttype": "none"}):
        figure.savefig(picture, format="svg", transparent=True, metadata=nothing)
    text = picture.getvalue().decode()
    return re.sub(r'(\bid="|href="#|url\(#)', rf"\g<1>{name}-", text[text.index("<svg") :])


def smooth(values: np.ndarray, window: int) -> np.ndarray:
    """Return the running mean over the last axis. Near the ends, the mean is over the values that exist."""
    window = min(window, values.shape[-1])
    if window <= 1:
        return values
    ones = np.ones(window)
    weights = np.convolve(np.ones(values.shape[-1]), ones, "same")
    return np.apply_along_axis(lambda row: np.convolve(row, ones, "same") / weights, -1, values)


def dash_of(number: int) -> Any:
    """Return the dash pattern of a curve by its index. When colours repeat, each is paired with another pattern."""
    return _DASHES[(number + number // len(COLOURS)) % len(_DASHES)]


def curve(
    axes: Axes,
    x: np.ndarray,
    runs: CurvesOfRuns,
    label: str,
    number: int = 0,
    *,
    colour: str | None = None,
    window: int = 1,
) -> dict[str, Curve]:
    """Draw the mean over runs, and with three or more runs its 95% interval (Student's) as a band.

    Args:
        axes: Axes to draw on.
        x: Horizontal coordinates, ``(n,)``.
        runs: One curve per run, ``(n_runs, n)``.
        label: Label of the curve.
        number: Index of the curve's dash pattern and, without ``colour``, of its colour.
        colour: Colour of the curve.
        window: Number of values of the running mean.

    Returns:
        The drawn values by label.
    """
    mean, low, high = interval_of_curves(smooth(runs, window))
    colour = colour or COLOURS[number % len(COLOURS)]
    axes.plot(x, mean, color=colour, linestyle=dash_of(number), label=label)
    if len(runs) < MIN_SEEDS:
        return {f"{label}": mean}
    axes.fill_between(x, low, high, color=colour, alpha=0.2, linewidth=0)
    return {label: mean, f"{label}, low": low, f"{label}, high": high}


def payoff_matrix(
    figure: Figure,
    axes: Axes,
    predators: GenerationIndices,
    prey: GenerationIndices,
    payoff: PayoffMatrix,
    top: float = 1.0,
    bottom: float = 0.0,
    name: str = "caught",
    words: str = "fraction of prey caught",
) -> dict[str, np.ndarray]:
    """Draw payoffs to the predators, ``(G, H)``, as the CIAO plot of both sides (Cliff & Miller 1995).

    Contemporaries meet on the dotted diagonal. Above it predators meet prey of earlier generations, below it prey of
    later ones. Returns the drawn values by name.

    Args:
        figure: Figure of the axes.
        axes: Axes to draw on.
        predators: Generations of the predators, int ``(G,)``.
        prey: Generations of the prey, int ``(H,)``.
        payoff: Payoffs, the fraction of prey caught for example.
        top: Payoff with the last colour of the scale.
        bottom: Payoff with the first colour of the scale.
        name: Name of the payoffs among the drawn values.
        words: Label of the colour bar.
    """
    image = axes.pcolormesh(
        prey, predators, payoff, vmin=bottom, vmax=top, cmap="viridis", shading="nearest", rasterized=True
    )
    axes.plot([prey[0], prey[-1]], [predators[0], predators[-1]], color="white", linewidth=0.8, linestyle=":")
    axes.set(xlabel="prey of generation", ylabel="predators of generation", aspect="equal")
    figure.colorbar(image, ax=axes, label=words, shrink=0.8)
    rows, columns = np.meshgrid(predators, prey, indexing="ij")
    return {"predators": rows.ravel(), "prey": columns.ravel(), name: payoff.ravel()}


def trajectories(axes: Axes, cells: Cells, n_predators: int, size: int) -> dict[str, np.ndarray]:
    """Draw the paths of one episode on the torus, like figures 4 and 6 of the paper.

    Args:
        axes: Axes to draw on.
        cells: Cells of all agents in the steps to show, int ``(n_steps, n_agents, 2)``, predators first.
        n_predators: Number of predators.
        size: Side of the torus, in cells.

    Returns:
        The drawn values by name.
    """
    for agent in range(cells.shape[1]):
        hunts = agent < n_predators
        path = _broken_at_seam(cells[:, agent].astype(float), size)
        colour = PREDATORS if hunts else PREY
        axes.plot(*path.T, color=colour, linestyle=_DASHES[agent if hunts else agent - n_predators], linewidth=1)
        axes.plot(*cells[0, agent], marker="o", color=colour, markersize=3, fillstyle="none")
        axes.plot(*cells[-1, agent], marker="^" if hunts else "s", color=colour, markersize=6)
    axes.set(aspect="equal", xticks=[], yticks=[], xlim=(-1, size), ylim=(-1, size))
    for spine in axes.spines.values():
        spine.set_visible(True)
    steps, agents = np.indices(cells.shape[:2])
    return {"step": steps.ravel(), "agent": agents.ravel(), "x": cells[..., 0].ravel(), "y": cells[..., 1].ravel()}


def _broken_at_seam(path: np.ndarray, size: int) -> np.ndarray:
    """Insert a gap (nan) where a path wraps around the torus, so that no line is drawn across the world."""
    jumps = np.flatnonzero((np.abs(np.diff(path, axis=0)) > size / 2).any(axis=1)) + 1
    return np.insert(path, jumps, np.nan, axis=0)
