"""How numbers are put."""

from __future__ import annotations

import numpy as np

from esp_trainer.analysis.inference import over_seeds
from reproduction.results import Results


def mean(values: np.ndarray, digits: int = 2) -> str:
    """A mean over seeds with its interval."""
    known = over_seeds(values)
    return f"{known.mean:.{digits}f} [{known.low:.{digits}f}, {known.high:.{digits}f}]"


def p_value(p: float) -> str:
    """Two figures, or a bound."""
    return f"{p:.2g}" if p >= 0.001 else "< 0.001"


def present(results: dict[str, Results], *arms: str) -> list[str]:
    """Those arms that have results."""
    return [arm for arm in arms if arm in results]
