"""The figures and tables of ``docs/learning.md``."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from study import fill, table

from esp_trainer.analysis import plots
from esp_trainer.analysis.inference import MIN_SEEDS, over_seeds
from esp_trainer.files import write_text
from esp_trainer.types import Role
from learning.runs import LONG, POINTS, STANDING, STEPS, TUNED
from predprey_env.tasks import DEFAULT_OPPONENTS

Curves = dict[str, list[list[list[float]]]]
"""By what was run, for each seed the points of its curve: steps, CPU seconds, and fractions of prey caught."""
AT_STEPS, AT_SECONDS, SAMPLED, GREEDY, HELD_OUT = range(5)


def by_kind(kept: dict[str, list[list[float]]]) -> Curves:
    """Return runs, which are named ``what/seed``, by what was run."""
    found: Curves = {}
    for name, points in kept.items():
        found.setdefault(name.rpartition("/")[0], []).append(points)
    return found


def write(curves: Curves, place: Path) -> None:
    """Write the page and its figures."""
    _draw(curves, place / "learning" / "curves.png")
    for task, role in LONG:
        if runs := curves.get(f"long, {task}, {role}"):
            _draw_long(runs, curves, task, role, place / "learning")

    def level(name: str, column: int = HELD_OUT) -> str:
        return fraction(_last(curves[name], column)) if name in curves else "-"

    values = {
        "pond": level("pond, predators", SAMPLED),
        **{f"{task}_{role}": level(f"long, {task}, {role}") for task, role in LONG},
        "3v2_predators_against_script": level("long, 3v2, predators", SAMPLED),
        "3v2_predators_script_against_script": level("standing, 3v2, intercept", SAMPLED),
        **{
            f"{task}_{role}_{kind}": level(f"standing, {task}, {team}")
            for task, role in LONG
            for kind, team in _beside(task, role)
        },
        "command": _command(),
        "tasks": _tasks(curves),
        "long": long(curves),
        "arms": _options(curves, "tuned, ", (SAMPLED, HELD_OUT)),
        "options": _options(curves, "option, ", (SAMPLED, GREEDY)),
        "evolution": _evolution(curves),
    }
    write_text(place / "learning.md", fill(Path(__file__).with_name("page.md"), values))


def fraction(values: list[float]) -> str:
    """Return a mean fraction over seeds with its interval, as far as that lies between 0 and 1."""
    if len(values) < MIN_SEEDS:
        return f"{np.mean(values):.3f}"
    found = over_seeds(values)
    return f"{found.mean:.3f} [{max(found.low, 0):.3f}, {min(found.high, 1):.3f}]"


def first(points: list[list[float]], level: float, column: int) -> float:
    """Return the steps or CPU seconds after which a run first catches a fraction; infinity if never."""
    return next((point[column] for point in points if point[SAMPLED] >= level), np.inf)


def _command() -> str:
    steps, options = LONG["steppe", "predators"], (f"    --{n.replace('_', '-')} {value}" for n, value in TUNED.items())
    return " \\\n".join([f"python examples/ppo_one_team.py --task steppe --steps {steps}", *options])


def _last(runs: list[list[list[float]]], column: int) -> list[float]:
    return [points[-1][column] for points in runs]


def _spent(runs: list[list[list[float]]]) -> list[str]:
    """Return the steps and the CPU seconds of the runs, their means."""
    steps, seconds = (float(np.mean(_last(runs, column))) for column in (AT_STEPS, AT_SECONDS))
    return [f"{steps / 1e6:.1f} M", f"{seconds:.0f}"]


def _tasks(curves: Curves) -> str:
    rows = [
        [name, len(runs), *_spent(runs), *(fraction(_last(runs, column)) for column in (SAMPLED, GREEDY))]
        for name in (f"{task}, {team}" for task in STEPS for team in DEFAULT_OPPONENTS)
        if (runs := curves.get(name))
    ]
    return table(["task and team that learns", "runs", "steps", "CPU seconds", "prey caught, sampled", "greedy"], rows)


def _options(curves: Curves, kind: str, columns: tuple[int, int]) -> str:
    heads = {SAMPLED: "prey caught, sampled", GREEDY: "greedy", HELD_OUT: "of held-out evolved prey"}
    rows = [
        [name.removeprefix(kind), *(_known(runs, column) for column in columns), _spent(runs)[1]]
        for name, runs in curves.items()
        if name.startswith(kind)
    ]
    return table(["changed", *(heads[column] for column in columns), "CPU seconds"], rows)


def _known(runs: list[list[list[float]]], column: int) -> str:
    return fraction(_last(runs, column)) if len(runs[0][-1]) > column else "-"


def long(curves: Curves) -> str | None:
    """Return the table of the long runs and what stands beside them, or nothing without such runs."""
    rows = []
    for task, role in LONG:
        if runs := curves.get(f"long, {task}, {role}"):
            rows.append([f"{task}, {role}", "PPO", len(runs), *_spent(runs), *_both(runs)])
            rows += [
                [f"{task}, {role}", f"`{team}`", "-", "-", "-", *_both(there)]
                for _, team in _beside(task, role)
                if (there := curves.get(f"standing, {task}, {team}"))
            ]
    heads = (
        "task and team",
        "policy",
        "runs",
        "steps",
        "CPU seconds",
        "caught, script",
        "caught, held-out evolved teams",
    )
    return table(heads, rows) if rows else None


def _both(runs: list[list[list[float]]]) -> list[str]:
    return [fraction(_last(runs, column)) for column in (SAMPLED, HELD_OUT)]


def _evolution(curves: Curves) -> str:
    def reached(runs: list[list[list[float]]], level: float) -> str:
        columns = AT_SECONDS, AT_STEPS
        seconds, steps = (float(np.median([first(points, level, column) for points in runs])) for column in columns)
        return f"{seconds:.1f} s, {steps / 1e6:.2f} M" if np.isfinite(steps) else "-"

    rows = []
    for name in ["pond, predators", *(name for name in curves if name.startswith("evolved, "))]:
        if not (runs := curves.get(name)):
            continue
        levels = (reached(runs, level) for level in (0.4, 0.8))
        steps, seconds = _spent(runs)
        rows.append([name, len(runs), *levels, fraction(_last(runs, SAMPLED)), f"{seconds} s, {steps}"])
    return table(["predators of pond", "runs", "0.4 caught after", "0.8 caught after", "in the end", "spent"], rows)


def _on_grid(runs: list[list[list[float]]], column: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return steps, mean CPU seconds there, and a column of all runs there."""
    grid = np.linspace(0, min(_last(runs, AT_STEPS)), POINTS + 1)
    seconds, values = (
        np.array(
            [np.interp(grid, *np.array([[point[AT_STEPS], point[each]] for point in points]).T) for points in runs]
        )
        for each in (AT_SECONDS, column)
    )
    return grid, seconds.mean(axis=0), values


def _draw(curves: Curves, path: Path) -> None:
    """Draw the fraction caught by steps and by CPU seconds: a column for each task."""
    figure, axes = plots.panels(2 * len(STEPS), width=3.3)
    data: dict[str, np.ndarray] = {}
    for number, (panel, task) in enumerate(zip(axes, [*STEPS, *STEPS], strict=True)):
        by_time = number >= len(STEPS)
        unit = "CPU seconds" if by_time else "million steps"
        for team, colour in {"predators": plots.PREDATORS, "prey": plots.PREY}.items():
            if f"{task}, {team}" not in curves:
                continue
            steps, seconds, caught = _on_grid(curves[f"{task}, {team}"], SAMPLED)
            x = seconds if by_time else steps / 1e6
            drawn = plots.curve(panel, x, caught, f"{team} learn", colour=colour, number=team == "prey")
            data |= {f"{task}, {team}, {unit}": x} | {f"{task}, {key}": value for key, value in drawn.items()}
        panel.set(title=task, xlabel="CPU seconds" if by_time else "million steps of agents", ylim=(0, 1))
    axes[0].set_ylabel("fraction of prey caught")
    axes[len(STEPS)].set_ylabel("fraction of prey caught")
    plots.legend_above(axes[0])
    plots.save(figure, path, data)


def _draw_long(runs: list[list[list[float]]], curves: Curves, task: str, role: Role, place: Path) -> None:
    """Draw long runs: a panel for each kind of opponent, with what stands beside them as levels.

    CPU seconds stand above the panels; they grow in proportion to the steps.
    """
    figure, axes = plots.panels(2, width=4.2, height=3.2)
    steps, seconds, _ = _on_grid(runs, SAMPLED)
    steps /= 1e6
    cost = seconds[-1] / steps[-1]
    data = {"million steps": steps, "CPU seconds": seconds}
    for panel, column in zip(axes, (SAMPLED, HELD_OUT), strict=True):
        opponent = "held-out evolved teams" if column == HELD_OUT else DEFAULT_OPPONENTS[role]
        drawn = plots.curve(panel, steps, _on_grid(runs, column)[2], "PPO")
        data |= {f"{opponent}, {key}": value for key, value in drawn.items()}
        for number, (kind, team) in enumerate(_beside(task, role), start=1):
            if there := curves.get(f"standing, {task}, {team}"):
                style = {"color": plots.COLOURS[number], "linestyle": plots.dash_of(number)}
                panel.axhline(_last(there, column)[0], label=kind.replace("script", f"script {team}"), **style)
        panel.set(title=f"{task}, against {opponent}", xlabel="million steps of agents", ylim=(0, 1))
        above = panel.secondary_xaxis("top", functions=(lambda x: x * cost, lambda x: x / cost))
        above.set_xlabel("CPU seconds")
    axes[0].set_ylabel("fraction of prey caught")
    plots.legend_above(axes[0])
    plots.save(figure, place / f"{task}-{role}.png", data)


def _beside(task: str, role: Role) -> list[tuple[str, str]]:
    """Return the kinds and the names of those that stand beside the long runs."""
    return list(zip(("script", "best evolved team"), STANDING[task, role], strict=True))
