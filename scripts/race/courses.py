"""How the behaviours of the recommended race change as it goes on, and which of them go with skill."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from study import table

from esp_trainer.analysis import plots
from esp_trainer.analysis.gains import sixths
from esp_trainer.analysis.inference import over_seeds, summary
from race import endpoints
from race.measure import Arrays, Task

NAMES = (
    *("role switch", "blocker", "opposing attack", "encirclement"),
    *("herding", "baiting", "simultaneous capture", "scattering", "sidestepping"),
)
SEEN = 0.05
"""Rate beyond chance from which a behaviour is worth a word."""


def known(arrays: Arrays) -> list[str]:
    """Return the behaviours that were measured, and are defined for the teams."""
    return [name for name in NAMES if (key := f"behaviour.{name}") in arrays and np.isfinite(arrays[key]).any()]


def tell(arrays: Arrays, figure: str) -> str:
    """Return the courses of behaviours as Markdown."""
    rows = []
    for name in known(arrays):
        first, last = _ends(arrays, name)
        rows.append([name, f"{first.mean():.3f}", f"{last.mean():.3f}", summary(last - first)])
    heads = ["behaviour", "first sixth", "last sixth", "change"]
    picture = f"![Rates of behaviours beyond chance in `race`, by generation]({figure})"
    return "\n\n".join([picture, _TEXT.format(n=len(arrays["config"])), table(heads, rows)])


def in_short(found: Task) -> str:
    """Return which behaviours become more frequent with two prey, or an empty string if none does."""
    arrays, grown = found["race"], []
    for name in known(arrays):
        first, last = _ends(arrays, name)
        if last.mean() >= SEEN and over_seeds(last - first).low > 0:
            grown.append(f"{name} {first.mean():.2f} to {last.mean():.2f}")
    told = "**Predators hunt together more often as the race goes on** (two prey; thought of after the runs). Episodes "
    told += "beyond chance, first to last sixth of the run: "
    return (told + ", ".join(grown) + "." + _TAKES * (found.keys() >= _COMPARED)) * bool(grown)


def _ends(arrays: Arrays, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the rate of a behaviour beyond chance in the first and the last sixth, ``(n_seeds,)`` each."""
    first, last = sixths(endpoints.course(arrays, name))
    return np.nanmean(first, axis=1), np.nanmean(last, axis=1)


def draw(arrays: Arrays, file: Path) -> None:
    """Draw the rate of each behaviour by generation: those of predators that hunt together, and the others."""
    names = known(arrays)
    figure, axes = plots.panels(2, width=4.6, columns=2)
    data: dict[str, np.ndarray] = {"generation": arrays["generations"][0]}
    for panel, shown in zip(axes, (names[:4], names[4:]), strict=True):
        for number, name in enumerate(shown):
            course = endpoints.course(arrays, name)
            data |= plots.curve(panel, data["generation"], course, name, number, window=3)
        panel.set(xlabel="generation", ylabel="rate beyond chance")
        plots.legend(panel)
    plots.save(figure, file, data)


_COMPARED = {"bias", "paper", "pool", "race-monolithic"}
_TAKES = (
    " Role switches and encirclements are about as frequent with bias genes alone (`bias`), and rare without bias "
    "genes or with one network an agent; whose networks matter is not known."
)
_TEXT = """\
How `race` changes: rates beyond chance in the first and the last sixth of the generations, and the change [95% interval
over {n} seeds]. This was thought of after the runs and tests nothing."""
