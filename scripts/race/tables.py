"""The tables of ``docs/race.md``, and their columns, each a function of a condition's measurements."""

from __future__ import annotations

from collections.abc import Callable

from esp_trainer.analysis.inference import holm, summary
from esp_trainer.types import ROLES, Role
from race import endpoints
from race.measure import Arrays

Column = Callable[[Arrays], str]


def _level(role: Role, panel: str) -> Column:
    return lambda arrays: summary(endpoints.level(arrays, role, panel)) if f"{panel}.{role}" in arrays else "-"


def _gain(role: Role, *, half: bool) -> Column:
    return lambda arrays: str(endpoints.over_runs_and_panel(endpoints.gains(arrays, role, half=half)))


def _genes(role: Role) -> Column:
    def column(arrays: Arrays) -> str:
        scale = arrays[f"scale.{role}"].astype(float).mean(axis=0)
        return f"{scale[0]:.1f} -> {scale[-1]:.1f}"

    return column


def _exploited(role: Role) -> Column:
    def column(arrays: Arrays) -> str:
        by_third = endpoints.exploited(arrays, role)
        return " -> ".join(f"{value:.2f}" for value in by_third.mean(axis=0))

    return column


def behaviour(name: str) -> Column:
    """Return the column of a behaviour, beyond chance."""
    return lambda arrays: summary(endpoints.behaviour(arrays, name)) if f"behaviour.{name}" in arrays else "-"


LEVELS = {
    "seeds": lambda arrays: str(len(arrays["config"])),
    "predators, panel": _level("predators", "panel"),
    "prey, panel": _level("prey", "panel"),
    "predators, zoo": _level("predators", "held_out"),
    "prey, zoo": _level("prey", "held_out"),
    "predators, scripts": _level("predators", "scripts"),
    "prey, scripts": _level("prey", "scripts"),
}
GAINS = {f"{role}{', 2nd half' * half}": _gain(role, half=half) for half in (False, True) for role in ROLES}
GAINS |= {f"genes, {role}": _genes(role) for role in ROLES}
EXPLOITED = {f"fresh {role}": _exploited(role) for role in ROLES}


def by_condition(found: dict[str, Arrays], columns: dict[str, Column]) -> str:
    """Return a table with a row for each condition."""
    lines = ["| condition | " + " | ".join(columns) + " |", "| --- |" + " --- |" * len(columns)]
    for name, arrays in found.items():
        lines.append(f"| `{name}` | " + " | ".join(column(arrays) for column in columns.values()) + " |")
    return "\n".join(lines)


def lesser_gains(found: dict[str, Arrays]) -> str:
    """Return a table of the lesser side's gain, tested against runs that are read backwards."""
    rows = []
    for half in (False, True):
        for arrays in found.values():
            both = [endpoints.gains(arrays, role, half=half).mean(axis=1) for role in ROLES]
            rows.append(endpoints.lesser_gain(*both))
    corrected = holm([p for _, p in rows])
    lines = [
        "The lesser side's gain, mean over seeds, with its p against runs read backwards (Holm over this table).",
        "",
        "| condition | whole run | p | 2nd half | p |",
        "| --- | --- | --- | --- | --- |",
    ]
    for i, name in enumerate(found):
        j = i + len(found)
        cells = f"{rows[i][0]:+.3f} | {corrected[i]:.2g} | {rows[j][0]:+.3f} | {corrected[j]:.2g}"
        lines.append(f"| `{name}` | {cells} |")
    return "\n".join(lines)
