"""``report``: runs as one page."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from esp_trainer.cli.analysis import say
from esp_trainer.report.measure import Settings
from esp_trainer.report.page import write_page
from esp_trainer.report.source import Source, read


def report(runs: Sequence[Path], out: Path | None, settings: Settings) -> int:
    """Write the page of what is whole of some runs, and say on it what is missing."""
    if len({run.resolve() for run in runs}) < len(runs):
        raise ValueError(f"runs must be different ones, got {', '.join(map(str, runs))}")
    sources, notes = _read(runs)
    _check(sources)
    lengths = [len(source) for source in sources]
    if len(set(lengths)) > 1:
        notes.append(
            f"The runs have {min(lengths)} to {max(lengths)} generations: the first {min(lengths)} of each are shown."
        )
        sources = [source.first(min(lengths)) for source in sources]
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
    first = sources[0]
    for source in sources[1:]:
        if source.config.env != first.config.env:
            raise ValueError(f"runs must play in the same world, got {first.path} and {source.path}, whose env differ")
        ours, theirs = (
            [side.policy == "esp" for side in (each.config.predators, each.config.prey)] for each in (first, source)
        )
        if ours != theirs:
            raise ValueError(f"runs must evolve the same sides, got {first.path} and {source.path}, which do not")
