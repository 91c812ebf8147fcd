"""Moments to show in a report: for some phases and each behaviour, the moment that shows it best.

Figures 4 and 6 of the paper show such moments, chosen by eye; here the detectors choose them. Each behaviour is shown
once: with the phase that it sets apart, or by itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from esp_trainer.analysis.behaviours.registry import BEHAVIOURS
from esp_trainer.analysis.phases import Phase
from esp_trainer.arrays import BoolMask
from esp_trainer.report.measure import REPORTED_BEHAVIOURS, SEEN, MeasuredRuns, Watched

PHASES = 6
"""Maximum number of phases that are shown."""


def of_phases(runs: Sequence[MeasuredRuns]) -> list[dict[str, Any]]:
    """Return a moment for each phase that a behaviour sets apart from the rest of its run, at most :data:`PHASES`.

    They are the phases of the first run that has more than one phase. A behaviour that sets several phases apart is
    shown with the one in which it stands out most.
    """
    for number, run in enumerate(runs):
        if run.watched and len(run.phases) > 1:
            apart = [each for i, phase in enumerate(run.phases) if (each := _set_apart(run.watched, i, phase))]
            best: dict[str, tuple[float, int, str]] = {}
            for difference, i, name in sorted(apart):
                best[name] = (difference, i, name)
            chosen = sorted(best.values(), reverse=True)[:PHASES]
            return [
                _of_phase(number, run.watched, i, run.phases[i], name)
                for _, i, name in sorted(chosen, key=lambda each: each[1])
            ]
    return []


def why_no_phases(runs: Sequence[MeasuredRuns]) -> str:
    """Return the reason why :func:`of_phases` does not return a moment of each phase; empty if it does.

    It is also empty for runs without phases, because the story says that there are none.
    """
    shown = len(of_phases(runs))
    n_phases = max((len(run.phases) for run in runs), default=0)
    if shown:
        first = next(len(run.phases) for run in runs if run.watched and len(run.phases) > 1)
        return f"Of {first} phases, those with a behaviour of their own are shown." if first > shown else ""
    return "Phases have no pictures: none has a behaviour of its own." if n_phases > 1 else ""


def _inside(watched: Watched, phase: Phase) -> BoolMask:
    return (watched.generations >= phase.start) & (watched.generations < phase.end)


def _set_apart(watched: Watched, i: int, phase: Phase) -> tuple[float, int, str] | None:
    """Return the behaviour that sets a phase apart, preceded by its difference and the phase; None if none does."""
    inside = _inside(watched, phase)
    seen = [name for name in REPORTED_BEHAVIOURS if any(name in watched.moments[at] for at in np.flatnonzero(inside))]
    apart = [
        (float(np.nanmean(watched.excess(name)[inside]) - np.nanmean(watched.excess(name))), i, name) for name in seen
    ]
    best = max(apart, default=(0.0, i, ""))
    return best if best[0] >= SEEN else None


def _of_phase(number: int, watched: Watched, i: int, phase: Phase, name: str) -> dict[str, Any]:
    inside, excess = _inside(watched, phase), watched.excess(name)
    at = max((at for at in np.flatnonzero(inside) if name in watched.moments[at]), key=lambda at: excess[at])
    text = (
        f"{_definition(name)} Beyond chance it is seen in {100 * np.nanmean(excess[inside]):z.0f}% of the episodes of "
        f"generations {phase.start} to {phase.end - 1}, and in {100 * np.nanmean(excess):z.0f}% of all. In this phase "
        f"{phase.mean:.2f} of the prey are caught."
    )
    title = f"Phase {i + 1}: {name}"
    return {"title": title, "text": text, **_moment(number, watched, int(at), name)}


def of_behaviours(runs: Sequence[MeasuredRuns], without: Iterable[str] = ()) -> list[dict[str, Any]]:
    """Return a moment of each behaviour that was seen, from the run and generation with its highest rate.

    Args:
        runs: Measured runs.
        without: Behaviours to leave out.
    """
    found = []
    for name in [name for name in REPORTED_BEHAVIOURS if name not in without]:
        seen = [
            (float(run.watched.excess(name)[at]), number, at)
            for number, run in enumerate(runs)
            if run.watched
            for at, moments in enumerate(run.watched.moments)
            if name in moments
        ]
        if seen:
            _, number, at = max(seen, key=lambda each: each[0])
            watched = runs[number].watched
            assert watched is not None
            rate = watched.rates[name][at]
            often = (
                f"Seen in {100 * rate.rate:.0f}% of this generation's episodes, by chance in {100 * rate.null:.0f}%."
            )
            text = f"{_definition(name)} {often}"
            found.append({"title": name.capitalize(), "text": text, **_moment(number, watched, at, name)})
    return found


def _definition(name: str) -> str:
    return f"{BEHAVIOURS[name].meaning.capitalize()}."


def _moment(number: int, watched: Watched, at: int, name: str) -> dict[str, Any]:
    """Return a moment in the form that the page's player reads."""
    moment = watched.moments[at][name]
    return {
        "run": number,
        "generation": int(watched.generations[at]),
        "behaviour": name,
        "start": moment.cells[0].tolist(),
        "step": moment.step,
        "until": moment.until,
        "shown": moment.shown,
    }
