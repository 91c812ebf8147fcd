"""The tables of ``docs/benchmark.md``, whose text is in ``page.md``, and the figure of who catches whom."""

from __future__ import annotations

import sys
from dataclasses import astuple
from pathlib import Path

import numpy as np
from study import fill, table

from esp_trainer.analysis import plots
from esp_trainer.analysis.gains import Interval, over_runs_and_panel
from esp_trainer.analysis.inference import Comparison, compare
from esp_trainer.files import write_text
from learners.matrix import Matrix
from predprey_env.policies import SCRIPTS

EQUAL = (
    ("ppo, early", "paper"),
    ("ppo, early", "modern"),
    ("ppo, early", "drawn"),
    ("ppo", "paper, longer"),
    ("ppo", "modern, longer"),
    ("ppo, self-play", "paper, longer"),
    ("ppo, self-play", "modern, longer"),
)
"""Kinds that are compared: PPO, and evolution with no more compute."""
APART = ("ppo", "ppo, early", "ppo, terminal")
"""Kinds that are two runs, one for each side."""
_SCRIPTS = (*SCRIPTS["predators"], *SCRIPTS["prey"])
Cells = dict[tuple[str, str], Interval]


def write(matrix: Matrix, out: Path) -> Path:
    """Write the page, its figure and the figure's data."""
    place = out / "benchmark"
    place.mkdir(parents=True, exist_ok=True)
    rows, columns = _kinds(matrix.predators), _kinds(matrix.prey)
    cells = {(p, q): over_runs_and_panel(matrix.caught[np.ix_(rows[p], columns[q])]) for p in rows for q in columns}
    _draw(cells, list(rows), list(columns), place)
    compared, tests = _equal(matrix)
    options = [word for word in sys.argv[1:] if word != "--report"]
    values = {
        "command": " ".join(["python", "scripts/compare_learners.py", *options]),
        "n_episodes": matrix.n_episodes,
        "contestants": _contestants(matrix),
        "strength": _strength(matrix),
        "equal": compared,
        "n_differences": len(tests),
        "behind": sum(test.high < 0 for test in tests),
        "ahead": sum(test.low > 0 for test in tests),
        "matrix": table(["", *columns], [[f"**{p}**", *(_put(cells[p, q]) for q in columns)] for p in rows]),
    }
    page = out / "benchmark.md"
    write_text(page, fill(Path(__file__).with_name("page.md"), values))
    return page


def _kinds(names: np.ndarray) -> dict[str, np.ndarray]:
    return {str(name): np.flatnonzero(names == name) for name in dict.fromkeys(names.tolist())}


def _put(known: Interval, sign: str = "") -> str:
    return f"{known.mean:{sign}.2f} [{known.low:{sign}.2f}, {known.high:{sign}.2f}]"


def _contestants(matrix: Matrix) -> str:
    """Return who is compared, and what a run cost."""
    rows = []
    for name, meaning in matrix.meanings.tolist():
        hunts, flees = matrix.predators == name, matrix.prey == name
        spent = np.concatenate([matrix.predators_spent[hunts], matrix.prey_spent[flees]])
        known = not np.isnan(spent).all()
        cost = [f"{spent[:, 0].mean():.1f}", f"{spent[:, 1].mean() / 1e6:,.0f} M"] if known else ["-", "-"]
        rows.append([f"`{name}`", meaning, max(hunts.sum(), flees.sum()), *cost])
    return table(["name", "what it is", "seeds", "CPU seconds a run", "agents' steps a run"], rows)


def _strength(matrix: Matrix) -> str:
    """Return how each does against held-out teams, scripts, and learners of another name."""
    sides = (
        (matrix.predators, matrix.prey, matrix.caught, matrix.predators_held_out),
        (matrix.prey, matrix.predators, 1 - matrix.caught.T, 1 - matrix.prey_held_out.T),
    )
    lines = []
    for name, _ in matrix.meanings.tolist():
        cells = []
        for mine, theirs, caught, held_out in sides:
            rows, scripted = np.flatnonzero(mine == name), np.isin(theirs, _SCRIPTS)
            against = held_out[rows], caught[rows][:, scripted], caught[rows][:, ~scripted & (theirs != name)]
            cells += [_put(over_runs_and_panel(each)) for each in against] if len(rows) else ["-"] * 3
        lines.append([f"`{name}`", *cells])
    heads = ["name", "predators: held-out prey", "scripted prey", "all who learn"]
    return table([*heads, "prey: held-out predators", "scripted predators", "all who learn"], lines)


def _equal(matrix: Matrix) -> tuple[str, list[Comparison]]:
    """Return PPO less evolution where evolution had no more compute, and the tests."""
    rows: list[list[str]] = []
    tests: list[Comparison] = []
    for one, other in EQUAL:
        if (matrix.predators == one).any() and (matrix.predators == other).any():
            pairs = zip(_scores(matrix, one), _scores(matrix, other), strict=True)
            found = [compare(a, b) for a, b in pairs]
            tests += found
            cost = f"{_cost(matrix, one):.0f} and {_cost(matrix, other):.0f}"
            cells = [_put(Interval(test.difference, test.low, test.high), "+") for test in found]
            rows.append([f"`{one}` less `{other}`", cost, *cells, _put(_head_to_head(matrix, one, other), "+")])
    scores = ["predators: held-out prey", "prey: held-out predators", "predators: scripted prey"]
    heads = ["compared", "CPU seconds", *scores, "prey: scripted predators", "head to head"]
    return table(heads, rows), tests


def _scores(matrix: Matrix, name: str) -> list[np.ndarray]:
    """Return what each seed's predators and prey score against held-out teams, and then against scripts."""
    hunts, flees = matrix.predators == name, matrix.prey == name
    scripted = np.isin(matrix.prey, _SCRIPTS), np.isin(matrix.predators, _SCRIPTS)
    return [
        matrix.predators_held_out[hunts].mean(axis=1),
        1 - matrix.prey_held_out[:, flees].mean(axis=0),
        matrix.caught[hunts][:, scripted[0]].mean(axis=1),
        1 - matrix.caught[scripted[1]][:, flees].mean(axis=0),
    ]


def _cost(matrix: Matrix, name: str) -> float:
    """Return the CPU seconds for a team of each side."""
    hunts = matrix.predators_spent[matrix.predators == name, 0].mean()
    return float(hunts + matrix.prey_spent[matrix.prey == name, 0].mean() if name in APART else hunts)


def _head_to_head(matrix: Matrix, one: str, other: str) -> Interval:
    """Return the prey that one's predators catch of the other's, less those that the other's catch of one's."""
    ours = matrix.caught[np.ix_(matrix.predators == one, matrix.prey == other)]
    theirs = matrix.caught[np.ix_(matrix.predators == other, matrix.prey == one)]
    return over_runs_and_panel(ours - theirs.T)


def _draw(cells: Cells, rows: list[str], columns: list[str], place: Path) -> None:
    means = np.array([[cells[p, q].mean for q in columns] for p in rows])
    figure, (axes,) = plots.panels(1, width=2.2 + 0.55 * len(columns), height=1.6 + 0.4 * len(rows), columns=1)
    image = axes.pcolormesh(means, vmin=0, vmax=1, cmap="viridis", rasterized=True)
    for (y, x), mean in np.ndenumerate(means):
        colour = "white" if mean < 0.6 else "black"
        axes.text(x + 0.5, y + 0.5, f"{mean:.2f}", ha="center", va="center", fontsize=7, color=colour)
    axes.set(yticks=np.arange(len(rows)) + 0.5, xticks=np.arange(len(columns)) + 0.5, xlabel="prey", ylabel="predators")
    axes.set_yticklabels(rows)
    axes.set_xticklabels(columns, rotation=40, ha="right")
    axes.invert_yaxis()
    figure.colorbar(image, ax=axes, label="fraction of prey caught", shrink=0.8)
    names = ("predators", "prey", "caught", "low", "high")
    data = zip(*[(p, q, *astuple(known)) for (p, q), known in cells.items()], strict=True)
    plots.save(figure, place / "matrix.png", dict(zip(names, data, strict=True)))
