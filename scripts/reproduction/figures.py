"""The figures of the report, each drawn from the measurements alone and saved with its data."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from esp_trainer.analysis import plots, progress
from esp_trainer.analysis.inference import over_seeds
from reproduction.cells import All
from reproduction.results import StudyResults
from reproduction.settings import PARITY

WINDOW = 15
"""Generations of the running means in success curves."""

_ONE_PREY = {"monolithic-3v1": "one network", "monolithic-3v1-wide": "one wide network", "paper-3v1": "split networks"}
_TWO_PREY = {"monolithic-3v2": "one network", "paper-3v2": "split networks"}
_TASKS = {"one prey": _ONE_PREY, "two prey": _TWO_PREY}


def success(results: All, place: Path) -> None:
    """Draw the fraction caught, champion against champion, by generation."""
    figure, axes = plots.panels(2, width=4.6, columns=2)
    data: dict[str, np.ndarray] = {}
    for panel, (task, arms) in zip(axes, _TASKS.items(), strict=True):
        for number, (arm, label) in enumerate(arms.items()):
            if arm in results:
                caught = results[arm]["curve.caught"].astype(float)
                x = np.arange(caught.shape[1])
                drawn = plots.curve(panel, x, caught, label, number, window=WINDOW)
                data |= {"generation": x} | {f"{arm}: {name}": values for name, values in drawn.items()}
        panel.set(title=task, xlabel="generation", ylabel="fraction of prey caught", ylim=(0, 1))
        plots.legend(panel)
    plots.save(figure, place / "success.png", data)


def ciao(results: All, place: Path) -> None:
    """Draw who catches whom, mean over seeds."""
    arms = [arm for task in _TASKS.values() for arm in task if arm in results]
    figure, axes = plots.panels(len(arms), width=3.7, height=3.2)
    tables = []
    for panel, arm in zip(axes, arms, strict=True):
        generations, caught = results[arm].generations, results[arm].caught.mean(axis=0)
        tables.append((arm, plots.payoff_matrix(figure, panel, generations, generations, caught, top=0.8)))
        panel.set_title(arm)
    columns = ("predators", "prey", "caught")
    data = {"arm": np.concatenate([[arm] * len(table["caught"]) for arm, table in tables])}
    data |= {name: np.concatenate([table[name] for _, table in tables]) for name in columns}
    plots.save(figure, place / "ciao.png", data)


def _both_sides(results: All, place: Path, name: str, ylabel: str, sides: str) -> None:
    """Draw a row of panels for each task: predators' and prey's curves of its settings."""
    figure, axes = plots.panels(4, width=4.6, columns=2)
    data: dict[str, np.ndarray] = {}
    for row, (task, arms) in enumerate(_TASKS.items()):
        for number, (arm, label) in enumerate(arms.items()):
            if arm not in results:
                continue
            found = results[arm]
            both = found.historical_progress() if sides == "own" else found.global_progress()
            for column, role in enumerate(("predators", "prey")):
                curves = np.array([getattr(side, role).curve for side in both])
                panel = axes[2 * row + column]
                drawn = plots.curve(panel, found.generations, curves, label, number)
                panel.set(
                    title=f"{role} ({task})",
                    xlabel="generation",
                    ylabel=ylabel.format("caught" if column == 0 else "not caught"),
                )
                data |= {"generation": found.generations}
                data |= {f"{arm}, {role}: {part}": values for part, values in drawn.items()}
    for number, panel in enumerate(axes):
        panel.set_ylim(0, 1)
        plots.legend(panel, loc="lower center" if number == 3 else "upper center")
    plots.save(figure, place / f"{name}.png", data)


def master(results: All, place: Path) -> None:
    """Draw the master tournament: against all opponents of the own run."""
    _both_sides(results, place, "master", "prey {}, own opponents", "own")


def held_out(results: All, place: Path) -> None:
    """Draw results against the panel of held-out runs."""
    _both_sides(results, place, "global", "prey {}, held-out opponents", "panel")


def behaviours(results: All, place: Path) -> None:
    """Draw rates beyond chance by generation, with intervals over seeds."""
    arms = [arm for arm in ("paper-3v1", "paper-3v2") if arm in results]
    names = [key.removeprefix("behaviour.") for key in results[arms[-1]].arrays if key.startswith("behaviour.")]
    figure, axes = plots.panels(len(names), width=3.1, height=2.1, columns=4)
    data: dict[str, np.ndarray] = {}
    for panel, name in zip(axes, names, strict=True):
        for number, arm in enumerate(arms):
            rates = results[arm].behaviour(name)
            if np.isnan(rates).all(axis=0).any():
                continue
            rates = np.where(np.isnan(rates), np.nanmean(rates, axis=0), rates)  # a seed in which it could not be asked
            drawn = plots.curve(panel, results[arm]["watched"][0], rates, arm, number)
            data |= {"generation": results[arm]["watched"][0]}
            data |= {f"{arm}, {name}: {part}": values for part, values in drawn.items()}
        panel.axhline(0, color="0.7", linewidth=0.6)
        panel.set(title=name, ylim=(-0.05, 1))
    plots.legend(axes[1], loc="upper right")
    axes[0].set(xlabel="generation", ylabel="rate over chance")
    plots.save(figure, place / "behaviours.png", data)


def scripts(results: All, place: Path) -> None:
    """Draw predators against the fixed prey that they evolved against, and against scripts that they never met."""
    figure, axes = plots.panels(2, width=4.6, columns=2)
    arms = {
        axes[0]: ("fleeing-prey", "fleeing-prey-central"),
        axes[1]: ("paper-3v1", "no-idling-3v1", "paper-3v2", "no-idling-3v2"),
    }
    data: dict[str, np.ndarray] = {}
    for panel, shown in arms.items():
        for number, arm in enumerate(arm for arm in shown if arm in results):
            found = results[arm]
            caught = found.caught[..., 0] if panel is axes[0] else found["scripts.predators"].astype(float).mean(axis=2)
            drawn = plots.curve(panel, found.generations, caught, arm, number)
            data |= {"generation": found.generations} | {f"{arm}: {part}": values for part, values in drawn.items()}
        panel.set(xlabel="generation", ylabel="fraction of prey caught", ylim=(0, 1))
        plots.legend(panel)
    axes[0].set_title("the fixed prey that they evolve against")
    axes[1].set_title("scripted prey that they never met")
    plots.save(figure, place / "scripts.png", data)


def parity(results: All, place: Path) -> None:
    """Draw captures by the number of predators that start at an even distance."""
    arms = [arm for arm in PARITY if arm in results]
    figure, axes = plots.panels(len(arms), width=3.7, height=2.8)
    data: dict[str, np.ndarray] = {}
    for panel, arm in zip(axes, arms, strict=True):
        curves = results[arm]["curve.caught_by_even"].astype(float)
        x = np.arange(curves.shape[1])
        for even in range(curves.shape[2]):
            known = np.nan_to_num(curves[:, :, even])
            drawn = plots.curve(panel, x, known, f"{even} even", even, window=WINDOW)
            data |= {"generation": x} | {f"{arm}, {even} even: {part}": values for part, values in drawn.items()}
        panel.set(title=arm, xlabel="generation", ylabel="fraction of prey caught", ylim=(0, 1))
    plots.legend_above(axes[0])
    plots.save(figure, place / "parity.png", data)


def forest(results: All, place: Path, name: str, parts: tuple[str, ...]) -> None:
    """Draw progress against held-out opponents by setting: predators, prey, and the lesser of the two.

    The paper's own settings are always there, to compare with.
    """
    own = ("paper-3v1", "paper-3v2")
    rows = [found for name, found in results.items() if found.setting.part in parts or name in own]
    tasks = {
        "one prey": [r for r in rows if r.setting.config.env.n_prey == 1],
        "two prey": [r for r in rows if r.setting.config.env.n_prey == 2],
    }
    tasks = {task: [r for r in arms if "panel.prey" in r and "panel.predators" in r] for task, arms in tasks.items()}
    figure, axes = plots.panels(2, width=5.2, height=0.8 + 0.28 * max(map(len, tasks.values())), columns=2)
    table: list[tuple[str, str, float, float, float]] = []
    for panel, (task, arms) in zip(axes, tasks.items(), strict=True):
        for y, found in enumerate(arms[::-1]):
            table += _row(panel, y, found)
        panel.sharex(axes[0])
        panel.axvline(0, color="0.7", linewidth=0.6)
        panel.set(title=task, yticks=range(len(arms)), yticklabels=[found.setting.name for found in arms[::-1]])
        panel.set_xlabel("progress against held-out opponents, fraction of prey")
    plots.legend(next(panel for panel, arms in zip(axes, tasks.values(), strict=True) if arms))
    columns = zip(*table, strict=True)
    plots.save(figure, place / f"{name}.png", dict(zip(("arm", "side", "mean", "low", "high"), columns, strict=True)))


def _row(panel: Axes, y: int, found: StudyResults) -> list[tuple[str, str, float, float, float]]:
    both = found.global_progress()
    sides = {
        "predators": (plots.PREDATORS, "o", np.array([side.predators.strength for side in both])),
        "prey": (plots.PREY, "s", np.array([side.prey.strength for side in both])),
        "lesser of both": ("0.2", "D", np.array([progress.two_sided(side) for side in both])),
    }
    rows = []
    for offset, (name, (colour, marker, values)) in zip((0.22, 0.0, -0.22), sides.items(), strict=True):
        estimate = over_seeds(values)
        label = name if y == 0 else None
        panel.plot([estimate.low, estimate.high], [y + offset] * 2, color=colour, linewidth=1)
        panel.plot(estimate.mean, y + offset, marker, color=colour, markersize=3.5, label=label)
        rows.append((found.setting.name, name, estimate.mean, estimate.low, estimate.high))
    return rows
