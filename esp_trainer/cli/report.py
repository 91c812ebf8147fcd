"""``report``: runs as one page."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from esp_trainer.cli.analysis import say
from esp_trainer.report.measure import Settings
from esp_trainer.report.page import write_page
from esp_trainer.report.source import Source, read
from esp_trainer.run.checkpoint import NO_MATTER
from predprey_env.settings import flat


def report(runs: Sequence[Path], out: Path | None, settings: Settings) -> int:
    """Write the page of what is whole of some runs, and say on it what is missing."""
    if len({run.resolve() for run in runs}) < len(runs):
        raise ValueError(f"runs must be different ones, got {', '.join(map(str, runs))}")
    sources, notes = _read(runs)
    _check(sources)
    notes += _differences(sources)
    if len({source.name for source in sources}) < len(sources):
        sources = [replace(source, name=str(source.path)) for source in sources]
    lengths = [len(source) for source in sources]
    if len(set(lengths)) > 1:
        notes.append(
            f"The runs have {min(lengths)} to {max(lengths)} generations: the first {min(lengths)} of each are shown."
        )
        sources = [source.first(min(lengths)) for source in sources]
    kept = [source.history.kept for source in sources if source.history]
    if any(not np.array_equal(each, kept[0]) for each in kept):
        raise ValueError("runs must have the champions of the same generations: they differ by esp.hof_size or length")
    place = out or (runs[0] if len(runs) == 1 else Path(os.path.commonpath([run.parent.resolve() for run in runs])))
    place = place / "report.html" if place.is_dir() else place
    write_page(sources, place, settings, say, notes)
    for line in [*notes, *(f"{source.name}: {line}" for source in sources for line in source.missing)]:
        say(f"note: {line}")
    print(f"open {place} in a browser ({place.stat().st_size / 1e6:.1f} MB)")
    return 0


def _read(runs: Sequence[Path]) -> tuple[list[Source], list[str]]:
    """The runs that can be shown, and a line for each that cannot; if none can, the first one's error."""
    sources: list[Source] = []
    errors: list[OSError | ValueError] = []
    for run in runs:
        try:
            sources.append(read(run))
        except (FileNotFoundError, ValueError) as error:
            errors.append(error)
    if not sources:
        raise errors[0]
    return sources, [f"Left out: {error}." for error in errors]


def _check(sources: Sequence[Source]) -> None:
    """Raise :class:`ValueError` for runs that have no page in common."""
    first = sources[0]
    for number, source in enumerate(sources):
        config = source.config
        if config.env != first.config.env:
            raise ValueError(f"runs must play in the same world, got {first.path} and {source.path}, whose env differ")
        policies = [(each.predators.policy, each.prey.policy) for each in (first.config, config)]
        if policies[0] != policies[1]:
            raise ValueError(
                f"runs must evolve the same sides against the same scripts, got {first.path} and {source.path}, where "
                f"they are {' and '.join(policies[0])}, and {' and '.join(policies[1])}"
            )
        for other in sources[:number]:
            if config.model_dump(exclude=set(NO_MATTER)) == other.config.model_dump(exclude=set(NO_MATTER)):
                raise ValueError(
                    f"runs must be different ones, got {other.path} and {source.path} with the same config"
                )


def _differences(sources: Sequence[Source]) -> list[str]:
    """A line if runs are pooled that differ in more than their seeds."""
    configs = [flat(source.config.model_dump(exclude={*NO_MATTER, "seed", "preset"})) for source in sources]
    names = [name for name in configs[0] if len({str(config[name]) for config in configs}) > 1]
    values = [f"{name} ({', '.join(dict.fromkeys(str(config[name]) for config in configs))})" for name in names]
    return [f"The runs differ in {', '.join(values)}."] if names else []
