"""The file that declares a sweep, and the runs that it declares.

.. code-block:: toml

    preset = ["paper-3v2", "modern-3v2"]  # a list, or one name
    seeds = 10                            # seeds 0 to 9; or a list of seeds

    [fields]                              # of all runs; each value of a list makes its own runs, and is in their names
    generations = 100
    esp.n_trials = [500, 1000]

    [conditions.biased]                   # instead of lists: fields of a named condition, possibly with a preset
    prey.bias = true
"""

from __future__ import annotations

import re
import tomllib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from math import prod
from pathlib import Path
from typing import Any

from esp_trainer.coevolution.sides import check_parts
from esp_trainer.config import RunConfig
from esp_trainer.presets import preset
from predprey_env.settings import flat, unknown_field

_MOST = 100_000
_LONGEST_NAME = 255 - len("traceback-.txt")  # file systems allow 255; the traceback has the longest name
_NO_NAME = r'[<>:"/\\|?*\x00-\x1f]'  # characters that a directory cannot have in its name on every system
_ENTRIES = ["preset", "seeds", "fields", "conditions"]


@dataclass(frozen=True)
class PlannedRun:
    """A run of a sweep."""

    cell: str
    """Condition that the run shares with other seeds: its name, or its preset and its values of the fields given as
    lists."""
    config: RunConfig
    named: bool = False
    """True if the condition has a name of its own."""

    @property
    def name(self) -> str:
        """Name of the run's directory."""
        return f"{self.cell}-seed{self.config.seed}"


def read_plan(file: Path) -> list[PlannedRun]:
    """Return all runs of a sweep: presets by values of the varied fields by seeds, in the order of the file.

    Raises :class:`ValueError`, in one line, if something is wrong with the file.
    """
    return plan_of(file.read_bytes(), file)


def plan_of(declared: bytes, file: Path) -> list[PlannedRun]:
    """Return all runs of a sweep from its file's contents, for a caller that cannot read the file twice (a pipe)."""
    try:
        plan = _runs(tomllib.loads(_text(declared)))
        name, times = Counter(run.name for run in plan).most_common(1)[0]
        if times > 1:
            raise ValueError(f"runs must be different, got {name} {times} times")
        if any(run.config.league for run in plan):
            raise ValueError("league is no field of a sweep: only train begins a run with one")
        first: dict[str, str] = {}
        for run in plan:
            same = first.setdefault(run.config.model_dump_json(), run.name)
            if same != run.name:
                raise ValueError(f"runs must be different, got the same config for {same} and {run.name}")
        longest = max((run.name for run in plan), key=len)
        if len(longest) > _LONGEST_NAME:
            raise ValueError(
                f"a run is named by its values from lists, in at most {_LONGEST_NAME} characters, got {len(longest)}: "
                f"give fewer fields as lists, or make several sweeps of it; {longest[:60]}..."
            )
        _check_parts(plan)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{file}: {error}") from None
    return plan


def _check_parts(plan: Sequence[PlannedRun]) -> None:
    """Raise :class:`ValueError` unless the networks and the algorithms of all runs are found."""
    for cell, config in {run.cell: run.config for run in plan}.items():  # they do not depend on the seed
        try:
            check_parts(config)
        except ValueError as error:
            raise ValueError(f"{cell}: {error}") from None


def _text(declared: bytes) -> str:
    try:
        return declared.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        byte = error.object[error.start]
        raise ValueError(f"must be text in UTF-8, got byte 0x{byte:02x} at position {error.start}") from None


def _runs(declared: dict[str, Any]) -> list[PlannedRun]:
    presets, seeds, values = _checked(declared)
    conditions = _conditions(declared.get("conditions", {}))
    if conditions:
        return _named_conditions(conditions, presets, seeds, values)
    listed = [name for name, value in flat(declared.get("fields", {})).items() if isinstance(value, list)]
    runs = []
    for word, combination in product(presets, product(*values.values())):
        fields = dict(zip(values, combination, strict=True))
        config = preset(word).with_fields(fields)
        cell = "-".join([word, *(f"{name}={_word(fields[name])}" for name in listed)])
        runs += [PlannedRun(cell, config.replace(seed=seed)) for seed in seeds]
    return runs


def _named_conditions(
    conditions: dict[str, dict[str, Any]], presets: list[str], seeds: Sequence[int], values: dict[str, list[Any]]
) -> list[PlannedRun]:
    """Return the runs of each condition. A condition's fields take precedence over those of all runs."""
    listed = {"preset": presets, **values}
    for name, given in listed.items():
        if len(given) > 1:
            raise ValueError(f"with conditions, {name} must be one value, got {len(given)}")
    common = {name: given[0] for name, given in values.items()}
    runs = []
    for name, own in conditions.items():
        fields = {**common, **own}
        config = preset(fields.pop("preset", presets[0])).with_fields(fields)
        runs += [PlannedRun(name, config.replace(seed=seed), named=True) for seed in seeds]
    return runs


def _conditions(declared: Any) -> dict[str, dict[str, Any]]:
    """Return the fields of each condition by its name."""
    if not isinstance(declared, dict) or not all(isinstance(fields, dict) for fields in declared.values()):
        raise ValueError(f"conditions must be tables of fields by name, got {declared!r}")
    for name, fields in declared.items():
        if not name or re.search(_NO_NAME, name) or name.startswith("."):
            raise ValueError(f"a condition must have a name that a directory can have, got {name!r}")
        if "seed" in fields:
            raise ValueError("seed is no field of a condition: say seeds, above")
        for field, value in flat(fields).items():
            if isinstance(value, list | dict):
                raise ValueError(f"{field} of the condition {name} must be one value, got {value!r}")
        if not isinstance(fields.get("preset", ""), str):
            raise ValueError(f"preset of the condition {name} must be a name, got {fields['preset']!r}")
    return {name: flat(fields) for name, fields in declared.items()}


def _checked(declared: dict[str, Any]) -> tuple[list[str], Sequence[int], dict[str, list[Any]]]:
    """Return presets, seeds and the values of each field, checked as far as possible without a config."""
    unknown = [name for name in declared if name not in _ENTRIES]
    if unknown:
        raise ValueError(unknown_field(unknown[0], _ENTRIES))
    if "preset" not in declared:
        raise ValueError("preset is missing")
    presets = _all(str, "preset must be a name or a list of names", declared["preset"])
    seeds = declared.get("seeds", 1)
    seeds = range(seeds) if type(seeds) is int else _all(int, "seeds must be a number or a list of numbers", seeds)
    values = _values(declared.get("fields", {}))
    for what, given in {"preset": presets, "seeds": seeds, **values}.items():
        if not given:
            raise ValueError(f"{what} must hold at least one value, got none")
    n_conditions = max(1, len(_conditions(declared.get("conditions", {}))))
    n_runs = n_conditions * prod(map(len, (presets, seeds, *values.values())))
    if n_runs > _MOST:
        raise ValueError(f"a sweep must have at most {_MOST:,} runs, got {n_runs:,}")
    return presets, seeds, values


def _values(fields: Any) -> dict[str, list[Any]]:
    """Return the values of each field."""
    if not isinstance(fields, dict):
        raise ValueError(f"fields must be a table, got {fields!r}")
    # TOML reads bare dotted names as nested tables.
    values = {name: value if isinstance(value, list) else [value] for name, value in flat(fields).items()}
    for name, given in values.items():
        if any(isinstance(value, dict | list) for value in given):
            raise ValueError(f"{name} must be a value or a list of values, got {given!r}")
    for name, entry in (("preset", "preset"), ("seed", "seeds")):
        if name in values:
            raise ValueError(f"{name} is no field of a sweep: say {entry}, above [fields]")
    return values


def _all(kind: type, expected: str, value: Any) -> list[Any]:
    values = value if isinstance(value, list) else [value]
    if not all(type(each) is kind for each in values):
        raise ValueError(f"{expected}, got {value!r}")
    return values


def _word(value: Any) -> str:
    """Return a value as a part of a directory's name: ``module:Class`` becomes ``module-Class``."""
    return str(value).lower() if isinstance(value, bool) else re.sub(_NO_NAME, "-", str(value))
