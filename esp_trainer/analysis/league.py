"""A league from the champions of finished or unfinished runs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from esp_trainer.analysis.conditions import world_of
from esp_trainer.analysis.history import History
from esp_trainer.analysis.pooling import check_directories
from esp_trainer.arrays import TeamGenomes
from esp_trainer.coevolution.league import League, LeagueSource
from esp_trainer.coevolution.sides import side_config
from esp_trainer.config import RunConfig
from esp_trainer.run.checkpoint import difference
from esp_trainer.types import ROLES, Role
from predprey_env.sight import options_of


def league_of_runs(paths: Sequence[Path], config: RunConfig, n_champions: int = 6) -> League:
    """Return the league that consists of champions of some runs.

    Raises the errors of :meth:`History.of_run` too, for directories that hold no usable run.

    Args:
        paths: Directories of the runs.
        config: Config of the run whose opponent pools the champions join.
        n_champions: Maximum number of champions per run and evolved side, evenly spread over the generations.

    Raises:
        ValueError: The teams of a run cannot play in the config's world, or differ from it in the settings of a side.
            Controllers must be equal, because a batch of trials holds one controller per side.
    """
    check_directories(paths)
    genomes: dict[Role, list[TeamGenomes]] = {}
    sources = []
    for path in paths:
        history = History.of_run(path)
        _check_fits(path, history, config)
        generations = history.sample(n_champions)
        for role in history.champions:
            genomes.setdefault(role, []).append(history.genomes(role, generations))
        origin = history.config
        sources.append(LeagueSource(str(path), origin.preset, origin.seed, tuple(generations.tolist())))
    found = {role: np.concatenate(genomes[role]) for role in ROLES if role in genomes}
    return League(found, tuple(sources))


def _check_fits(path: Path, history: History, config: RunConfig) -> None:
    """Raise :class:`ValueError` unless the teams of a run can be opponents in a run with this config."""

    def needed(of: RunConfig) -> dict[str, Any]:
        bred = {"algorithm", "algorithm_options"}  # matter for breeding, not for play
        sides: dict[str, Any] = {role: side_config(of, role).model_dump(exclude=bred) for role in history.champions}
        return {"game": of.game.model_dump(), "env": world_of(of.env), "sight": options_of(of.env.sight), **sides}

    different = difference(needed(history.config), needed(config))
    if different:
        raise ValueError(f"{path} cannot be in the league: {different} here")
