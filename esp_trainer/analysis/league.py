"""A league from the champions of finished or unfinished runs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from esp_trainer.analysis.conditions import world_of
from esp_trainer.analysis.history import History
from esp_trainer.analysis.pooling import check_directories
from esp_trainer.coevolution.league import League, Source
from esp_trainer.coevolution.sides import side_config
from esp_trainer.config import RunConfig
from esp_trainer.run.checkpoint import difference
from esp_trainer.types import ROLES, Role


def league_of_runs(paths: Sequence[Path], config: RunConfig, n_champions: int = 6) -> League:
    """Return the league of some runs for a run with a config.

    Args:
        paths: Directories of the runs.
        config: Of the run whose opponent pools they join.
        n_champions: At most so many champions of each side that evolved, evenly spread over the generations of a run.

    Raises :class:`ValueError` if their teams cannot meet those of the run, or have other controllers: a batch of trials
    holds one controller a side. Raises what :meth:`History.of_run` does of a directory that holds no usable run.
    """
    check_directories(paths)
    genomes: dict[Role, list[np.ndarray]] = {}
    sources = []
    for path in paths:
        history = History.of_run(path)
        _check_fits(path, history, config)
        generations = history.sample(n_champions)
        for role in history.champions:
            genomes.setdefault(role, []).append(history.genomes(role, generations))
        origin = history.config
        sources.append(Source(str(path), origin.preset, origin.seed, tuple(generations.tolist())))
    found = {role: np.concatenate(genomes[role]) for role in ROLES if role in genomes}
    return League(found, tuple(sources))


def _check_fits(path: Path, history: History, config: RunConfig) -> None:
    """Raise :class:`ValueError` unless the teams of a run can be opponents in a run with a config."""

    def needed(of: RunConfig) -> dict[str, Any]:
        sides: dict[str, Any] = {role: side_config(of, role).model_dump() for role in history.champions}
        return {"env": world_of(of.env), **sides}

    different = difference(needed(history.config), needed(config))
    if different:
        raise ValueError(f"{path} cannot be in the league: {different} here")
