"""The tables of ``docs/race.md``, and their columns, each a function of a condition's measurements."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from study import table

from esp_trainer.analysis.gains import lesser_gain
from esp_trainer.analysis.inference import MIN_SEEDS, compare, holm, over_seeds, summary
from esp_trainer.types import ROLES, Role
from race import endpoints
from race.measure import Arrays

Column = Callable[[Arrays], str]


def _level(role: Role, panel: str) -> Column:
    return lambda arrays: summary(endpoints.level(arrays, role, panel)) if f"{panel}.{role}" in arrays else "-"


def _gain(role: Role, *, half: bool) -> Column:
    return lambda arrays: str(endpoints.mean_gain(arrays, role, half=half))


def _genes(role: Role) -> Column:
    def column(arrays: Arrays) -> str:
        scale = arrays[f"scale.{role}"].astype(float).mean(axis=0)
        return f"{scale[0]:.1f} -> {scale[-1]:.1f}"

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


def by_condition(found: dict[str, Arrays], columns: dict[str, Column]) -> str:
    """Return a table with a row for each condition."""
    rows = [
        [marked(name, len(arrays["config"])), *(column(arrays) for column in columns.values())]
        for name, arrays in found.items()
    ]
    return table(["condition", *columns], rows)


def marked(name: str, n_runs: int) -> str:
    """Return the name of a condition, with a mark if it has few runs."""
    return f"`{name}`{' †' * (n_runs < endpoints.ENOUGH)}"


def lesser_gains(found: dict[str, Arrays]) -> str:
    """Return a table of the lesser side's gain, tested against runs that are read backwards."""
    tests = {}
    for half in (False, True):
        for name, arrays in found.items():
            both = (endpoints.run_gains(arrays, role, half=half) for role in ROLES)
            tests[name, half] = lesser_gain(*both)
    corrected = dict(zip(tests, holm([p for _, p in tests.values()]), strict=True))
    rows = [[marked(name, len(arrays["config"]))] for name, arrays in found.items()]
    for half in (False, True):
        for row, name in zip(rows, found, strict=True):
            both = [endpoints.run_gains(found[name], role, half=half) for role in ROLES]
            gained = int((np.minimum(*both) > 0).sum())
            row += [f"{tests[name, half][0]:+.3f}", f"{corrected[name, half]:.2g}", f"{gained} of {len(both[0])}"]
    return table(["condition", "whole run", "p", "both gain", "2nd half", "p", "both gain"], rows)


def contrasts(found: dict[str, Arrays]) -> str:
    """Return a table of each other condition less `race`, at the end of the run and in its second half."""
    cells = {
        name: [compare(*each) for each in zip(_measures(arrays), _measures(found["race"]), strict=True)]
        for name, arrays in found.items()
        if name != "race"
    }
    corrected = iter(holm([each.p for row in cells.values() for each in row]))
    rows = [
        [marked(name, len(found[name]["config"])), *(f"{each.interval}, p {next(corrected):.2g}" for each in row)]
        for name, row in cells.items()
    ]
    return table(["condition", *(f"{role}, {what}" for role in ROLES for what in ("level", "2nd half"))], rows)


def _measures(arrays: Arrays) -> list[np.ndarray]:
    """Return each side's level at the end and its gain in the second half, ``(n_seeds,)`` each."""
    of_sides = (
        (endpoints.level(arrays, role, "panel"), endpoints.run_gains(arrays, role, half=True)) for role in ROLES
    )
    return [measure for side in of_sides for measure in side]


def arrows(values: np.ndarray) -> str:
    """Return values one after the other."""
    return " -> ".join(f"{value:.2f}" for value in values)


def change(first: np.ndarray, last: np.ndarray) -> str:
    """Return the mean over seeds of a change, ``(n_seeds,)`` each, with its interval for enough seeds."""
    changes = last - first
    if len(changes) < MIN_SEEDS:
        return f"{changes.mean():+.3f}"
    return over_seeds(changes).signed
