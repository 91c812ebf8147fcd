"""The measurements of a setting, with a seed a row, and the numbers that claims are made of."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path

import numpy as np

from esp_trainer import RunConfig
from esp_trainer.analysis import games, progress
from esp_trainer.analysis.behaviours.counts import is_alone, over_chance
from esp_trainer.analysis.games import Sides
from esp_trainer.analysis.phases import Alternation, alternation
from esp_trainer.analysis.progress import Progress
from reproduction.settings import Setting

CHANCE = 0.05
"""Largest p at which alternation of success counts as more than chance."""


class StudyResults:
    """The measurements of one setting: arrays by name, each ``(n_seeds, ...)``."""

    def __init__(self, setting: Setting, arrays: Mapping[str, np.ndarray]) -> None:
        self.setting = setting
        self.arrays = arrays

    def __getitem__(self, name: str) -> np.ndarray:
        return self.arrays[name]

    def __contains__(self, name: str) -> bool:
        return name in self.arrays

    @property
    def n_seeds(self) -> int:
        """Number of runs."""
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
        """Number of episodes behind each fraction of :attr:`caught`."""
        return int(self["met"][0].sum()) // self.setting.config.env.n_prey

    def late(self, curve: str) -> np.ndarray:
        """Return a curve's mean over the last third of the run, ``(n_seeds,)``."""
        values = self[f"curve.{curve}"].astype(float)
        return np.asarray(values[:, -(values.shape[1] // 3) :].mean(axis=1))

    def late_share(self, name: str, until: int | None = None) -> np.ndarray:
        """Return the mean fraction of prey caught in a table ``(n_seeds, G, n_opponents)``, over the opponents and the
        last sixth of the generations: ``(n_seeds,)``.
        """
        rows = np.flatnonzero(self._rows(0, until))
        values = self[name][:, rows[-max(1, len(rows) // 6) :]].astype(float)
        return np.asarray(values.mean(axis=(1, 2)))

    def _rows(self, since: int, until: int | None) -> np.ndarray:
        """Return which of the sampled generations lie between two, bool ``(G,)``."""
        return (self.generations >= since) & (self.generations < (until or np.inf))

    def global_progress(self, since: int = 0, until: int | None = None) -> list[Sides[Progress]]:
        """Return each run's progress against the held-out panel, between two generations."""
        rows = self._rows(since, until)
        hunted, hunting = self["panel.predators"].astype(float), self["panel.prey"].astype(float)
        return [
            Sides(progress.progress(predators[rows]), progress.progress(1 - prey[rows]))
            for predators, prey in zip(hunted, hunting, strict=True)
        ]

    def historical_progress(self) -> list[Sides[Progress]]:
        """Return each run's progress against its own opponents."""
        return [progress.historical_progress(caught) for caught in self.caught]

    def two_sided(self, since: int = 0, until: int | None = None) -> np.ndarray:
        """Return the lesser side's global progress, ``(n_seeds,)``."""
        return np.array([progress.two_sided(both) for both in self.global_progress(since, until)])

    @property
    def halfway(self) -> int:
        """The generation at which half of the run is over."""
        return int(self["curve.caught"].shape[1] // 2)

    def cyclic_share(self) -> np.ndarray:
        """Return the cyclic fraction of each run's win matrix, ``(n_seeds,)``."""
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
        """Return a behaviour's rate beyond chance by watched generation, ``(n_seeds, n_watched)``.

        For behaviours of one agent it is the rate.
        """
        rate, null = np.moveaxis(self[f"behaviour.{name}"].astype(float), -1, 0)
        return over_chance(rate, null, alone=is_alone(name))


def load(kept: Path, setting: Setting) -> StudyResults | None:
    """Return the results of a setting, or None if there are none of these very runs."""
    file = kept / f"{setting.name}.npz"
    if not file.exists():
        return None
    with np.load(file) as arrays:
        found = dict(arrays)
    told = json.loads(str(found.pop("about"))) if "about" in found else {}  # of all seeds, until this was "config"
    configs = [json.loads(config) for config in found.pop("config", np.empty(0, str)).tolist()]
    configs = configs or [{**told["config"], "seed": seed} for seed in told["seeds"]]
    same = [_named_alike(RunConfig.from_dict(config)) for config in configs]
    return StudyResults(setting, found) if same == [_named_alike(run.config) for run in setting.runs] else None


def _named_alike(config: RunConfig) -> RunConfig:
    return config.replace(preset="")
