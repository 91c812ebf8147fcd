"""The file that declares a sweep, and the runs that it stands for.

.. code-block:: toml

    preset = ["paper-3v2", "modern-3v2"]  # or one of them
    seeds = 10                            # 0 to 9; or a list

    [fields]                              # of every run's config; a list is tried value by value
    generations = 100
    esp.n_trials = [500, 1000]
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

from pydantic import Field

from esp_trainer.config import RunConfig
from esp_trainer.presets import preset
from predprey_env.settings import Settings

_SAID_ELSEWHERE = {"preset": "preset", "seed": "seeds"}


@dataclass(frozen=True)
class PlannedRun:
    """A run of a sweep."""

    cell: str
    """What it shares with the other seeds: its preset, and its values of the fields that are varied."""
    config: RunConfig

    @property
    def name(self) -> str:
        """Of its directory."""
        return f"{self.cell}-seed{self.config.seed}"


class SweepFile(Settings):
    """What a sweep's file says."""

    preset: str | list[str] = Field(min_length=1)
    """The experiments."""
    seeds: int | list[int] = Field(default=1)
    """How many, from 0 on, or which."""
    fields: dict[str, Any] = Field(default_factory=dict)
    """Field of the config, by its name with dots, to its value or a list of them."""


def read_plan(file: Path) -> list[PlannedRun]:
    """All runs of a sweep: presets by values of the varied fields by seeds, in the order of the file.

    Raises :class:`ValueError` with what is wrong with the file, in one line.
    """
    try:
        declared = SweepFile.from_dict(tomllib.loads(file.read_text(encoding="utf-8")))
        plan = list(_runs(declared))
        names = [run.name for run in plan]
        twice = {name for name in names if names.count(name) > 1} if len(set(names)) < len(names) else set()
        if twice:
            raise ValueError(f"runs must be different, got {min(twice)} more than once")
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{file}: {error}") from None
    return plan


def _runs(declared: SweepFile) -> list[PlannedRun]:
    presets = [declared.preset] if isinstance(declared.preset, str) else declared.preset
    seeds = list(range(declared.seeds)) if isinstance(declared.seeds, int) else declared.seeds
    values = {name: value if isinstance(value, list) else [value] for name, value in _flat(declared.fields).items()}
    for name in values:
        if name in _SAID_ELSEWHERE:
            raise ValueError(f"{name} is no field of a sweep: say {_SAID_ELSEWHERE[name]}, above [fields]")
    for what, given in {"seeds": seeds, **{f"fields.{name}": given for name, given in values.items()}}.items():
        if not given:
            raise ValueError(f"{what} must hold at least one value, got none")
    varied = [name for name, given in values.items() if len(given) > 1]
    runs = []
    for word, combination in product(presets, product(*values.values())):
        fields = dict(zip(values, combination, strict=True))
        config = preset(word).with_fields(fields)
        cell = "-".join([word, *(f"{name}={_word(fields[name])}" for name in varied)])
        runs += [PlannedRun(cell, config.replace(seed=seed)) for seed in seeds]
    return runs


def _flat(tree: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Tables within tables, by their names with dots: TOML makes them of bare dotted keys."""
    found: dict[str, Any] = {}
    for name, value in tree.items():
        found |= _flat(value, f"{prefix}{name}.") if isinstance(value, dict) else {prefix + name: value}
    return found


def _word(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
