"""Learning curves of PPO: prey caught in training, by steps."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from esp_trainer.analysis import plots
from learners.contestants import TeamKind
from learners.matrix import Kept
from learners.train import curve_file

POINTS = 40


@dataclass(frozen=True)
class Curves(Kept):
    """One curve for each run and side, over as many points from its first step to its last."""

    names: np.ndarray
    """str ``(n,)``: the contestant."""
    roles: np.ndarray
    """str ``(n,)``: whose steps are counted."""
    steps: np.ndarray
    """float64 ``(n, POINTS)``: of agents."""
    caught: np.ndarray
    """float64 ``(n, POINTS)``: fraction of prey, against the opponents of the training."""


def gather(contestants: Iterable[TeamKind], place: Path) -> Curves:
    """Return the curves of every run of PPO, once."""
    last = [each for each in contestants if each.method == "ppo" and each.part == 10]
    found = [
        (each.name, role, *_read(curve_file(place, each, role, seed), role))
        for each in last
        for role in each.roles
        for seed in each.seeds
    ]
    names, roles, steps, caught = zip(*found, strict=True)
    return Curves(np.array(names), np.array(roles), np.array(steps), np.array(caught))


def _read(file: Path, role: str) -> tuple[np.ndarray, np.ndarray]:
    with file.open() as rows:
        lines = [line for line in csv.DictReader(rows) if line["role"] == role]
    steps, caught = (np.array([float(line[name]) for line in lines]) for name in ("steps", "caught"))
    points = np.linspace(steps[0], steps[-1], POINTS)
    return points, np.interp(points, steps, plots.smooth(caught, 5))


def draw(curves: Curves, path: Path) -> None:
    """Draw a panel for each side: means over seeds with 95% intervals."""
    figure, axes = plots.panels(2, width=4.6, columns=2)
    data: dict[str, np.ndarray] = {}
    for panel, role in zip(axes, ("predators", "prey"), strict=True):
        for number, name in enumerate(dict.fromkeys(curves.names.tolist())):
            runs = (curves.names == name) & (curves.roles == role)
            steps = curves.steps[runs].mean(axis=0) / 1e6
            drawn = plots.curve(panel, steps, curves.caught[runs], name, number)
            data |= {f"{name}, {role}: million steps": steps}
            data |= {f"{name}, {role}: {part}": values for part, values in drawn.items()}
        panel.set(
            title=f"{role} learn", xlabel="million steps of agents", ylabel="fraction of prey caught", ylim=(0, 1)
        )
    plots.legend_above(axes[0])
    plots.save(figure, path, data)
