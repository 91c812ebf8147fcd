"""Cells and rows of the tables of ``docs/reproduction.md``."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from esp_trainer.analysis.inference import over_seeds
from esp_trainer.analysis.progress import Progress
from esp_trainer.types import ROLES
from reproduction.results import StudyResults

All = Mapping[str, StudyResults]
"""The results of each setting, by name."""


def mean(values: Iterable[float] | np.ndarray, digits: int = 2) -> str:
    """Return a mean over seeds with its interval."""
    known = over_seeds(np.asarray(values, float))
    return f"{known.mean:.{digits}f} [{known.low:.{digits}f}, {known.high:.{digits}f}]"


def p_value(p: float) -> str:
    """Return two figures, or a bound."""
    return f"{p:.2g}" if p >= 0.001 else "< 0.001"


def rows_of(results: All, names: Iterable[str], row: Callable[[StudyResults], list[str]]) -> list[list[str]]:
    """Return a row for each setting that was run: its name, and the cells that ``row`` returns."""
    return [[f"`{name}`", *row(results[name])] for name in names if name in results]


def strengths(both: Sequence[tuple[Progress, Progress]], digits: int = 3) -> list[str]:
    """Return the mean progress of the predators, and of the prey."""
    return [mean([sides[i].strength for sides in both], digits) for i in range(len(ROLES))]
