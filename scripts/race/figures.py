"""The figures of ``docs/race.md``, each with its data beside it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from esp_trainer.analysis import plots
from esp_trainer.analysis.inference import compare
from esp_trainer.types import ROLES, Role
from race import endpoints
from race.measure import Arrays

Curves = Callable[[Arrays, Role], tuple[np.ndarray, np.ndarray]]
"""Returns the generations, ``(n,)``, and what each seed's side reached in them, ``(n_seeds, n)``."""


def draw(task: str, every: dict[str, Arrays], shown: Sequence[str], place: Path) -> None:
    """Draw what the conditions of a task reach against the panel, by fresh evolution and by their own exploiters, and
    how far all conditions end from `race`; curves of the conditions ``shown`` alone, or of all if none is there.
    """
    found = {name: every[name] for name in shown if name in every} or every
    _draw(found, _level, "", "generation", "against the panel", place / f"level-{task}.png")
    _draw(found, _fresh, "fresh ", "generation of the frozen side", "reached", place / f"exploited-{task}.png")
    if "race" in found and len(every) > 1:
        _differences(every, place / f"differences-{task}.png")
    if own := {name: arrays for name, arrays in found.items() if "exploited.prey" in arrays}:
        file = place / f"exploiters-{task}.png"
        _draw(own, endpoints.exploiters, "exploiting ", "generation", "against the champion", file, window=3)


def _level(arrays: Arrays, role: Role) -> tuple[np.ndarray, np.ndarray]:
    return arrays["generations"][0], endpoints.results(arrays, role, "panel").mean(axis=2)


def _fresh(arrays: Arrays, role: Role) -> tuple[np.ndarray, np.ndarray]:
    return arrays["response.generations"][0], endpoints.fresh(arrays, role)


def _draw(
    found: dict[str, Arrays], curves: Curves, who: str, x_label: str, y_label: str, file: Path, window: int = 1
) -> None:
    """Draw a panel for each side, with a curve for each condition."""
    figure, axes = plots.panels(2, width=4.6, columns=2)
    data: dict[str, np.ndarray] = {}
    for panel, role in zip(axes, ROLES, strict=True):
        for number, (name, arrays) in enumerate(found.items()):
            x, values = curves(arrays, role)
            drawn = plots.curve(panel, x, values, name, number, window=window)
            data |= {"generation": x} | {f"{role}, {name}: {part}": each for part, each in drawn.items()}
        panel.set(title=who + role, xlabel=x_label, ylabel=y_label, ylim=(0, 1))
    plots.legend_above(axes[0])
    plots.save(figure, file, data)


def _differences(found: dict[str, Arrays], file: Path) -> None:
    """Draw the level of each condition at the end, less that of `race`; a row a condition."""
    names = [name for name in found if name != "race"][::-1]
    figure, axes = plots.panels(2, width=4.6, height=0.9 + 0.25 * len(names), columns=2)
    data: dict[str, Sequence[object]] = {"condition": names}
    for panel, role in zip(axes, ROLES, strict=True):
        levels = {name: endpoints.level(arrays, role, "panel") for name, arrays in found.items()}
        each = [compare(levels[name], levels["race"]) for name in names]
        ends = np.array([(one.low, one.difference, one.high) for one in each]).T
        panel.errorbar(ends[1], names, xerr=(ends[1] - ends[0], ends[2] - ends[1]), fmt="o", color=plots.COLOURS[0])
        panel.axvline(0, color="0.6", linewidth=0.8)
        panel.locator_params(axis="x", nbins=5)
        panel.set(title=role, xlabel="level against the panel, less that of race")
        data |= {f"{role}: {part}": row.tolist() for part, row in zip(("low", "difference", "high"), ends, strict=True)}
    plots.save(figure, file, data)
