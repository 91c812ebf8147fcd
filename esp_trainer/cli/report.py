"""``report``: a page about one or several runs."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from esp_trainer.analysis.pooling import check_directories, check_same_config, note_on_champions, note_on_lengths
from esp_trainer.cli.streams import say
from esp_trainer.files import check_place
from esp_trainer.report.measure import ReportOptions
from esp_trainer.report.page import write_page
from esp_trainer.report.source import RunSource, cut, read_source


def report(runs: Sequence[Path], out: Path | None, settings: ReportOptions) -> int:
    """Write a page about the readable parts of some runs, with notes on what is missing."""
    check_directories(runs)
    sources, notes = read_all(runs)
    check_same_config([(source.path, source.config) for source in sources])
    if len({source.name for source in sources}) < len(sources):
        sources = [replace(source, name=str(source.path)) for source in sources]
    histories = [source.history for source in sources if source.history]
    champions = note_on_champions(histories) if histories else None
    notes += filter(None, [note_on_lengths([len(source) for source in sources]), champions])
    sources = cut(sources)
    place = place_of_page(runs, out, "report.html")
    check_place(place)
    write_page(sources, place, settings, say, notes)
    for line in [*notes, *(f"{source.name}: {line}" for source in sources for line in source.missing)]:
        say(f"note: {line}")
    print(f"open {place} in a browser ({place.stat().st_size / 1e6:.1f} MB)")
    return 0


def place_of_page(runs: Sequence[Path], out: Path | None, name: str) -> Path:
    """Return the file for a page about some runs.

    It is ``out``, or the file ``name`` in ``out`` if that is a directory. Without ``out``, the directory is that of the
    run, or the common parent of several runs.
    """
    place = out or (runs[0] if len(runs) == 1 else Path(os.path.commonpath([run.parent.resolve() for run in runs])))
    return place / name if place.is_dir() else place


def read_all(runs: Sequence[Path]) -> tuple[list[RunSource], list[str]]:
    """Return the readable runs, and a note on each other run; raise the first error if no run is readable."""
    sources: list[RunSource] = []
    errors: list[OSError | ValueError] = []
    for run in runs:
        try:
            sources.append(read_source(run))
        except (FileNotFoundError, ValueError) as error:
            errors.append(error)
    if not sources:
        raise errors[0]
    return sources, [f"Left out: {error}." for error in errors]
