"""Checks which runs may be measured together, and cuts them to their common generations."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import reduce
from pathlib import Path

import numpy as np

from esp_trainer.analysis.history import History
from esp_trainer.arrays import GenerationIndices
from esp_trainer.config import RunConfig
from esp_trainer.run.checkpoint import NO_MATTER
from predprey_env.settings import counted, flat

MAY_DIFFER = {"preset", "seed", *NO_MATTER}  # the preset is only a name
"""Fields in which runs that are measured together may differ."""


def check_directories(runs: Sequence[Path]) -> None:
    """Raise :class:`ValueError` if a directory is given twice."""
    times = Counter(run.resolve() for run in runs)
    twice = [str(run) for run in runs if times[run.resolve()] > 1]
    if twice:
        raise ValueError(f"runs must be different ones, got {', '.join(twice)}")


def check_same_config(runs: Sequence[tuple[Path, RunConfig]]) -> None:
    """Raise :class:`ValueError` unless the runs have the same config and different seeds.

    Number of generations, preset name, checkpoint interval and genealogy may differ.
    """
    (first_path, first), *others = runs
    seeds = {first.seed: first_path}
    wanted = flat(first.model_dump(exclude=MAY_DIFFER))
    for path, config in others:
        for name, value in flat(config.model_dump(exclude=MAY_DIFFER)).items():
            if value != wanted.get(name):
                raise ValueError(
                    f"runs must differ in nothing but their seeds, got {first_path} with {name}={wanted.get(name)} and "
                    f"{path} with {name}={value}; measure them one at a time"
                )
        if config.seed in seeds:
            raise ValueError(f"runs must have different seeds, got {seeds[config.seed]} and {path} with {config.seed}")
        seeds[config.seed] = path


def cut_to_shortest(histories: Sequence[History]) -> list[History]:
    """Return the histories cut to the length of the shortest, with champions of only the generations that all keep.

    Raises:
        ValueError: There is no generation whose champions all runs keep.
    """
    n = min(map(len, histories))
    kept = _kept_by_all(histories)
    if not len(kept):
        raise ValueError("runs must have champions of the same generations, got none that all of them have")
    return [history.first(n, kept) for history in histories]


def note_on_champions(histories: Sequence[History]) -> str | None:
    """Return a note if the uncut runs keep champions of different generations; None otherwise."""
    n, kept = min(map(len, histories)), _kept_by_all(histories)
    if all((history.kept < n).sum() == len(kept) for history in histories):
        return None
    return f"Champions of only {counted(len(kept), 'generation')} are kept by all runs."


def _kept_by_all(histories: Sequence[History]) -> GenerationIndices:
    n = min(map(len, histories))
    return reduce(np.intersect1d, [history.kept[history.kept < n] for history in histories])


def note_on_lengths(lengths: Sequence[int]) -> str | None:
    """Return a note if runs have different lengths and so are cut; None if all are equally long."""
    least, most = min(lengths), max(lengths)
    if least == most:
        return None
    return f"The runs have {least} to {most} generations: the first {least} of each are measured."
