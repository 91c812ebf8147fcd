"""The endpoints of ``docs/race-protocol.md``, computed from the measurements of a condition."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from esp_trainer.analysis.behaviours.counts import is_alone, over_chance
from esp_trainer.types import Role
from race.measure import PER_RUN, Arrays

RESAMPLES = 10_000
ENOUGH = 10
"""Runs from which an interval drawn from runs is taken at its word."""


@dataclass(frozen=True)
class Interval:
    """A mean over runs and opponents with its 95% interval over both."""

    mean: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.mean:+.3f} [{self.low:+.3f}, {self.high:+.3f}]"


def results(arrays: Arrays, role: Role, panel: str) -> np.ndarray:
    """Return what a side's generations did against a panel, higher is better: ``(n_seeds, G, n_opponents)``."""
    caught = arrays[f"{panel}.{role}"].astype(float)
    return caught if role == "predators" else 1.0 - caught


def gains(arrays: Arrays, role: Role, panel: str = "panel", *, half: bool = False) -> np.ndarray:
    """Return each run's gain against each opponent, the last sixth of its generations less the first:
    ``(n_seeds, n_opponents)``. With ``half``, of the second half of the run alone.
    """
    found = results(arrays, role, panel)
    found = found[:, found.shape[1] // 2 :] if half else found
    sixth = max(1, found.shape[1] // 6)
    return np.asarray(found[:, -sixth:].mean(axis=1) - found[:, :sixth].mean(axis=1))


def level(arrays: Arrays, role: Role, panel: str) -> np.ndarray:
    """Return each run's mean over the last sixth of its generations against a panel, ``(n_seeds,)``."""
    found = results(arrays, role, panel)
    return np.asarray(found[:, -max(1, found.shape[1] // 6) :].mean(axis=(1, 2)))


def over_runs_and_panel(table: np.ndarray, per_run: int = PER_RUN, seed: int = 0) -> Interval:
    """Return the mean of a table ``(n_seeds, n_opponents)`` with a percentile interval that counts both as samples.

    Runs and runs of the panel, ``per_run`` columns each, are drawn with replacement (Owen, The pigeonhole bootstrap,
    Annals of Applied Statistics 1, 2007).
    """
    generator = np.random.default_rng(seed)
    by_member = table.reshape(len(table), -1, per_run).mean(axis=2)
    rows = generator.multinomial(len(table), np.full(len(table), 1 / len(table)), RESAMPLES)
    n_members = by_member.shape[1]
    columns = generator.multinomial(n_members, np.full(n_members, 1 / n_members), RESAMPLES)
    means = np.einsum("br,rc,bc->b", rows, by_member, columns, optimize=True) / (len(table) * n_members)
    low, high = np.quantile(means, [0.025, 0.975])
    return Interval(float(by_member.mean()), float(low), float(high))


def lesser_gain(predators: np.ndarray, prey: np.ndarray, seed: int = 0) -> tuple[float, float]:
    """Return the mean over runs of the lesser side's gain, and its one-sided p.

    The lesser of two noisy numbers is below 0 where nothing changes, so it is not tested against 0. Where nothing
    changes, a run read backwards is as likely as the run, and turns the sign of both gains: the null distribution is
    that of the mean over all ways to turn runs round.

    Args:
        predators: Gain of each run's predators, ``(n_seeds,)``.
        prey: Of its prey.
        seed: Of the drawn signs.
    """
    forwards, backwards = np.minimum(predators, prey), np.minimum(-predators, -prey)
    found = float(forwards.mean())
    turned = np.random.default_rng(seed).random((RESAMPLES, len(forwards))) < 0.5
    null = np.where(turned, backwards, forwards).mean(axis=1)
    return found, float((1 + (null >= found - 1e-12).sum()) / (1 + RESAMPLES))


def behaviour(arrays: Arrays, name: str) -> np.ndarray:
    """Return the rate of a behaviour beyond chance, mean over the generations, ``(n_seeds,)``."""
    return np.asarray(np.nanmean(course(arrays, name), axis=1))


def course(arrays: Arrays, name: str) -> np.ndarray:
    """Return the rate of a behaviour beyond chance by generation, ``(n_seeds, n_generations)``."""
    rate, null = np.moveaxis(arrays[f"behaviour.{name}"].astype(float), -1, 0)
    return over_chance(rate, null, alone=is_alone(name))


def exploited(arrays: Arrays, role: Role) -> np.ndarray:
    """Return what fresh evolution of ``role`` reaches against frozen opponents, higher is better for it:
    ``(n_seeds, n_generations)``.
    """
    caught = arrays[f"response.{role}"][..., 1].astype(float)
    return caught if role == "predators" else 1.0 - caught
