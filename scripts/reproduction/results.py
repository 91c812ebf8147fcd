"""The measurements of all runs, by arm, with a seed a row; and the numbers that claims are made of."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path

import numpy as np

from esp_trainer.analysis import games, progress
from esp_trainer.analysis.behaviours.counts import is_alone, over_chance
from esp_trainer.analysis.games import Sides
from esp_trainer.analysis.phases import Alternation, alternation
from esp_trainer.analysis.progress import Progress
from reproduction.arms import Arm
from reproduction.measure import config_of, is_measured, measured_file

CHANCE = 0.05
"""How often success may alternate as much by chance."""


class Results:
    """What was measured of one arm: arrays by name, each ``(n_seeds, ...)``."""

    def __init__(self, arm: Arm, arrays: Mapping[str, np.ndarray]) -> None:
        self.arm = arm
        self.arrays = arrays

    def __getitem__(self, name: str) -> np.ndarray:
        return self.arrays[name]

    def __contains__(self, name: str) -> bool:
        return name in self.arrays

    @property
    def n_seeds(self) -> int:
        """Runs."""
        return len(self.arrays["generations"])

    @property
    def generations(self) -> np.ndarray:
        """Sampled generations, int ``(G,)``."""
        return np.asarray(self.arrays["generations"][0])

    @property
    def caught(self) -> np.ndarray:
        """Fraction of prey caught, predators by prey, of each run: ``(n_seeds, G, H)``."""
        return np.asarray(self["own.captured"].sum(axis=-1) / self["met"][:, None, None].sum(axis=-1))

    @property
    def episodes(self) -> int:
        """Behind each share of :attr:`caught`."""
        return int(self["met"][0].sum()) // self.arm.config.env.n_prey

    def late(self, curve: str) -> np.ndarray:
        """A curve's mean over the last third of the run, ``(n_seeds,)``."""
        values = self[f"curve.{curve}"].astype(float)
        return np.asarray(values[:, -(values.shape[1] // 3) :].mean(axis=1))

    def late_share(self, name: str, until: int | None = None) -> np.ndarray:
        """Shares of prey caught in a table ``(n_seeds, G, n_opponents)``: mean over the last sixth of the generations,
        and over the opponents, ``(n_seeds,)``.
        """
        rows = np.flatnonzero(self._rows(0, until))
        values = self[name][:, rows[-max(1, len(rows) // 6) :]].astype(float)
        return np.asarray(values.mean(axis=(1, 2)))

    def _rows(self, since: int, until: int | None) -> np.ndarray:
        """Return which of the sampled generations lie between two, bool ``(G,)``."""
        return (self.generations >= since) & (self.generations < (until or np.inf))

    def global_progress(self, since: int = 0, until: int | None = None) -> list[Sides[Progress]]:
        """Each run's progress against the held-out panel, between two generations."""
        rows = self._rows(since, until)
        hunted, hunting = self["panel.predators"].astype(float), self["panel.prey"].astype(float)
        return [
            Sides(progress.progress(predators[rows]), progress.progress(1 - prey[rows]))
            for predators, prey in zip(hunted, hunting, strict=True)
        ]

    def historical_progress(self) -> list[Sides[Progress]]:
        """Each run's progress against its own opponents."""
        return [progress.historical_progress(caught) for caught in self.caught]

    def two_sided(self, since: int = 0, until: int | None = None) -> np.ndarray:
        """The lesser side's global progress, ``(n_seeds,)``."""
        return np.array([progress.two_sided(both) for both in self.global_progress(since, until)])

    @property
    def halfway(self) -> int:
        """The generation at which half of the run is over."""
        return int(self["curve.caught"].shape[1] // 2)

    def cyclic_share(self) -> np.ndarray:
        """Share of who beats whom that depends on the opponent, ``(n_seeds,)``."""
        return np.array([1 - games.decompose(caught, self.episodes).transitive_share for caught in self.caught])

    @cached_property
    def alternations(self) -> list[Alternation]:
        """Alternations of success, champion against champion, of each run."""
        curves = self["curve.caught"].astype(float)
        return [alternation(curve, np.random.default_rng(0)) for curve in curves]

    def cycling(self) -> list[bool]:
        """Return for each run whether success goes there and back more often than an AR(1) curve does 1 time in 20.

        One rise that stays is an alternation too, but no cycle.
        """
        return [each.count >= 2 and each.p <= CHANCE for each in self.alternations]

    def behaviour(self, name: str) -> np.ndarray:
        """Rate over chance by watched generation, ``(n_seeds, n_watched)``; for behaviours of one agent, the rate."""
        rate, null = np.moveaxis(self[f"behaviour.{name}"].astype(float), -1, 0)
        return over_chance(rate, null, alone=is_alone(name))


def kept_file(kept: Path, arm: Arm) -> Path:
    """Return the file for the results of an arm."""
    return kept / f"{arm.name}.npz"


def load(kept: Path, arm: Arm) -> Results | None:
    """The results of an arm, if they are there, complete, and of this very setting."""
    file = kept_file(kept, arm)
    if not file.exists():
        return None
    with np.load(file) as arrays:
        found = dict(arrays)
    return Results(arm, found) if _is_about(str(found.pop("about", "{}")), arm) else None


def gather(place: Path, kept: Path, arm: Arm) -> None:
    """Keep what was measured of an arm's runs in one compressed file; nothing while some are missing."""
    if not all(is_measured(place, arm, seed) for seed in arm.seeds):
        return
    each = [dict(np.load(measured_file(place, arm, seed))) for seed in arm.seeds]
    arrays = {name: np.stack([found[name] for found in each]) for name in each[0] if name != "about"}
    kept.mkdir(parents=True, exist_ok=True)
    beside = kept_file(kept, arm).with_suffix(".part")
    with beside.open("wb") as file:
        np.savez_compressed(file, about=np.array(_about(arm)), **arrays)
    beside.replace(kept_file(kept, arm))


def _about(arm: Arm) -> str:
    return json.dumps({"config": arm.config.model_dump(), "seeds": arm.seeds})


def _is_about(about: str, arm: Arm) -> bool:
    told = json.loads(about)
    config = config_of(json.dumps(told.get("config")))
    same = config is not None and config.replace(preset=arm.name) == arm.config.replace(preset=arm.name)
    return same and told.get("seeds") == list(arm.seeds)
