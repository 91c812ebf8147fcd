"""Moments to show in a report: for each phase and each behaviour, the moment that shows it best.

Figures 4 and 6 of the paper show such moments, chosen by eye; here the detectors choose them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from esp_trainer.analysis.behaviours.registry import BEHAVIOURS
from esp_trainer.analysis.phases import Phase
from esp_trainer.report.measure import SEEN, SHOWN, MeasuredRuns, Watched


def of_phases(runs: Sequence[MeasuredRuns]) -> list[dict[str, Any]]:
    """Return a moment for each phase, of the behaviour that sets the phase apart from the rest of its run.

    They are the phases of the first run that has more than one phase.
    """
    for number, run in enumerate(runs):
        if run.watched and len(run.phases) > 1:
            found = [_of_phase(number, run.watched, i, phase) for i, phase in enumerate(run.phases)]
            return [moment for moment in found if moment]
    return []


def _of_phase(number: int, watched: Watched, i: int, phase: Phase) -> dict[str, Any] | None:
    inside = (watched.generations >= phase.start) & (watched.generations < phase.end)
    if not inside.any():
        return None
    seen = [name for name in SHOWN if any(name in watched.moments[at] for at in np.flatnonzero(inside))]
    if not seen:
        return None
    often = {name: float(np.nanmean(watched.excess(name)[inside])) for name in seen}
    apart = {name: often[name] - float(np.nanmean(watched.excess(name))) for name in seen}
    name = max(seen, key=lambda name: apart[name])
    marked = apart[name] >= SEEN
    if not marked:
        name = max(seen, key=lambda name: often[name])
    excess = watched.excess(name)
    at = max((at for at in np.flatnonzero(inside) if name in watched.moments[at]), key=lambda at: excess[at])
    title = f"Phase {i + 1}: generations {phase.start} to {phase.end - 1}"
    what = f"What sets it apart most is {name}" if marked else f"Nothing sets it apart; most often it is {name}"
    text = (
        f"{phase.mean:.2f} of the prey caught. {what}: in {100 * often[name]:z.0f}% of its episodes beyond chance, "
        f"{100 * np.nanmean(excess):z.0f}% in the whole run."
    )
    return {"title": title, "text": text, **_moment(number, watched, int(at), name)}


def of_behaviours(runs: Sequence[MeasuredRuns]) -> list[dict[str, Any]]:
    """Return a moment of each behaviour that was seen, from the run and generation with its highest rate."""
    found = []
    for name in SHOWN:
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
            often = f"In {100 * rate.rate:.0f}% of its generation's episodes, by chance in {100 * rate.null:.0f}%."
            text = f"{BEHAVIOURS[name].meaning.capitalize()}. {often}"
            found.append({"title": name.capitalize(), "text": text, **_moment(number, watched, at, name)})
    return found


def never_seen(runs: Sequence[MeasuredRuns]) -> list[str]:
    """Return the behaviours that are defined for the teams but were never seen."""
    watched = [run.watched for run in runs if run.watched]
    asked = [name for name in SHOWN if watched and not np.isnan(watched[0].excess(name)).all()]
    return [name for name in asked if not any(name in moments for each in watched for moments in each.moments)]


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
