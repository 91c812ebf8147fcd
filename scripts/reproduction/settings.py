"""The settings that are run: the sweeps of ``settings/``, one file for each part of the study."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from study import SMALL, SMALL_WORLD

from esp_trainer import RunConfig
from esp_trainer.sweep.plan import PlannedRun, read_plan
from predprey_env import EnvConfig

PLACE = Path(__file__).parent
PARTS = ("paper", "ablation", "sensitivity", "combination", "modern", "panel")
IN_SMALL = ("complementary-3v1", "scaled-3v1", "fleeing-prey", "fleeing-prey-central", "scale-0.5-3v2")
PARITY = ("paper-3v1", "scaled-3v1", "modern-3v1", "drawn-3v1", "prey-first-3v1", "no-idling-3v1", "odd-torus-3v1")
"""Settings in which captures are told apart by the parity of the start."""


@dataclass(frozen=True)
class Setting:
    """A condition of a sweep, with its runs of several seeds."""

    part: str
    meaning: str
    runs: tuple[PlannedRun, ...]

    @property
    def name(self) -> str:
        """Name of the condition."""
        return self.runs[0].cell

    @property
    def config(self) -> RunConfig:
        """Config of the first seed."""
        return self.runs[0].config

    @property
    def seeds(self) -> list[int]:
        """Seeds of the runs."""
        return [run.config.seed for run in self.runs]

    @property
    def world(self) -> EnvConfig:
        """The world without what concerns only fitness: teams of equal worlds can meet."""
        default = EnvConfig()
        return self.config.env.replace(prey_fitness=default.prey_fitness, closeness=default.closeness)


def read_settings() -> dict[str, Setting]:
    """Return every setting by name, in the order in which they are reported."""
    meanings = tomllib.loads((PLACE / "meanings.toml").read_text())
    found = {}
    for part in PARTS:
        plan = read_plan(PLACE / "settings" / f"{part}.toml")
        for name in dict.fromkeys(run.cell for run in plan):
            meaning = meanings.get(name) or meanings.get(name.removesuffix("-3v1").removesuffix("-3v2"), "")
            found[name] = Setting(part, meaning, tuple(run for run in plan if run.cell == name))
    return found


def small(settings: Mapping[str, Setting]) -> dict[str, Setting]:
    """Return some settings of each kind with two seeds, in a small world and with few generations."""
    names = [name for name, each in settings.items() if each.part == "paper"]
    names += [*IN_SMALL, "panel-3v1-1", "panel-3v2-1"]
    found = {}
    for name in names:
        runs = [replace(run, config=run.config.with_fields(SMALL | SMALL_WORLD)) for run in settings[name].runs[:2]]
        found[name] = replace(settings[name], runs=tuple(runs))
    return found
