"""The endpoints of ``docs/race-protocol.md``, computed from the measurements of a condition."""

from __future__ import annotations

import numpy as np

from esp_trainer.analysis.behaviours.counts import is_alone, over_chance
from esp_trainer.analysis.gains import Interval, gained, over_runs_and_panel, sixths
from esp_trainer.types import ROLES, Role
from race.measure import PER_RUN, Arrays

ENOUGH = 10
"""Runs from which an interval drawn from runs is taken at its word."""


def results(arrays: Arrays, role: Role, panel: str) -> np.ndarray:
    """Return what a side's generations did against a panel, higher is better: ``(n_seeds, G, n_opponents)``."""
    caught = arrays[f"{panel}.{role}"].astype(float)
    return caught if role == "predators" else 1.0 - caught


def gains(arrays: Arrays, role: Role, panel: str = "panel", *, half: bool = False) -> np.ndarray:
    """Return each run's gain against each opponent, the last sixth of its generations less the first:
    ``(n_seeds, n_opponents)``. With ``half``, of the second half of the run alone.
    """
    return gained(results(arrays, role, panel), half=half)


def run_gains(arrays: Arrays, role: Role, *, half: bool) -> np.ndarray:
    """Return each run's gain, mean over the panel, ``(n_seeds,)``."""
    return np.asarray(gains(arrays, role, half=half).mean(axis=1))


def mean_gain(arrays: Arrays, role: Role, *, half: bool, seeds: slice | list[int] = slice(None)) -> Interval:
    """Return the mean of some runs' gains against the panel, with its interval over runs and runs of the panel."""
    return over_runs_and_panel(gains(arrays, role, half=half)[seeds], PER_RUN)


def level(arrays: Arrays, role: Role, panel: str) -> np.ndarray:
    """Return each run's mean over the last sixth of its generations against a panel, ``(n_seeds,)``."""
    return np.asarray(sixths(results(arrays, role, panel))[1].mean(axis=(1, 2)))


def told_level(arrays: Arrays) -> str:
    """Return in words what both sides reach against the panel at the end of the run."""
    predators, prey = (level(arrays, role, "panel").mean() for role in ROLES)
    return f"{prey:.2f} of the prey escape the panel, and the predators catch {predators:.2f} of its prey"


def behaviour(arrays: Arrays, name: str) -> np.ndarray:
    """Return the rate of a behaviour beyond chance, mean over the generations, ``(n_seeds,)``."""
    return np.asarray(np.nanmean(course(arrays, name), axis=1))


def course(arrays: Arrays, name: str) -> np.ndarray:
    """Return the rate of a behaviour beyond chance by generation, ``(n_seeds, n_generations)``."""
    rate, null = np.moveaxis(arrays[f"behaviour.{name}"].astype(float), -1, 0)
    return over_chance(rate, null, alone=is_alone(name))


def fresh(arrays: Arrays, role: Role) -> np.ndarray:
    """Return what fresh evolution of ``role`` reaches against frozen opponents, higher is better for it:
    ``(n_seeds, n_generations)``.
    """
    return _against_frozen(arrays, role)[..., 1]


def contemporaries(arrays: Arrays, role: Role) -> np.ndarray:
    """Return what the champions of ``role`` reach against the same frozen opponents, which are their contemporaries."""
    return _against_frozen(arrays, role)[..., 0]


def _against_frozen(arrays: Arrays, role: Role) -> np.ndarray:
    caught = arrays[f"response.{role}"].astype(float)
    return caught if role == "predators" else 1.0 - caught


def exploiters(arrays: Arrays, role: Role) -> tuple[np.ndarray, np.ndarray]:
    """Return the generations in which a run's own exploiters of ``role`` were evolved, ``(n,)``, and what they reached
    against the champion of the moment, higher is better for them: ``(n_seeds, n)``.
    """
    caught = arrays[f"exploited.{role}"].astype(float)
    return arrays["exploited.generations"][0], caught if role == "predators" else 1.0 - caught
