"""All that the next generation follows from, in one file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from esp_trainer.coevolution.hall_of_fame import HallOfFame
from esp_trainer.coevolution.sides import EvolvingSide, Side, new_sides
from esp_trainer.config import RunConfig
from esp_trainer.esp.subpopulations import Subpopulations
from esp_trainer.files import DamagedFileError, read_arrays, write_arrays
from esp_trainer.types import Role

_MAY_CHANGE = ("generations", "checkpoint_every")
"""Settings that no generation depends on."""


def save_checkpoint(path: Path, config: RunConfig, sides: dict[Role, Side], generations: int) -> None:
    """Write the state after that many generations."""
    arrays, progress = {}, {}
    for role, side in sides.items():
        if isinstance(side, EvolvingSide):
            arrays[f"{role}.genomes"] = side.subpopulations.genomes
            arrays[f"{role}.fame"] = side.fame.champions
            best = side.best if np.isfinite(side.best) else None
            progress[role] = {"best": best, "stagnant": side.stagnant}
    header = {"config": config.model_dump(), "generations": generations, "sides": progress}
    write_arrays(path, "checkpoint", header, arrays)


def load_checkpoint(path: Path, config: RunConfig) -> tuple[dict[Role, Side], int]:
    """Both sides, and how many generations they have behind them."""
    header, arrays = read_arrays(path, "checkpoint")
    different = _difference(header.get("config", {}), config.model_dump())
    if different:
        raise ValueError(f"{path} belongs to another config: {different}")
    sides = new_sides(config)
    try:
        for role, side in sides.items():
            if isinstance(side, EvolvingSide):
                sides[role] = _restore(side, arrays[f"{role}.genomes"], arrays[f"{role}.fame"], header["sides"][role])
        return sides, int(header["generations"])
    except (KeyError, TypeError, ValueError) as error:
        raise DamagedFileError(f"{path} is not a usable checkpoint: {error}") from None


def _restore(fresh: EvolvingSide, genomes: np.ndarray, fame: np.ndarray, progress: dict[str, Any]) -> EvolvingSide:
    population = fresh.subpopulations
    if genomes.shape != population.genomes.shape or fame.shape[1:] != fresh.fame.champions.shape[1:]:
        raise ValueError(f"genomes must have shape {population.genomes.shape}, got {genomes.shape}")
    best = -np.inf if progress["best"] is None else float(progress["best"])
    restored = Subpopulations(population.config, population.controller, genomes.copy())
    return EvolvingSide(restored, HallOfFame(fame), best, int(progress["stagnant"]))


def _difference(saved: dict[str, Any], wanted: dict[str, Any], prefix: str = "") -> str | None:
    """The first setting that two configs do not share, in words."""
    for name in {**saved, **wanted}:
        ours, theirs = wanted.get(name), saved.get(name)
        if isinstance(ours, dict) and isinstance(theirs, dict):
            inner = _difference(theirs, ours, f"{prefix}{name}.")
            if inner:
                return inner
        elif ours != theirs and prefix + name not in _MAY_CHANGE:
            return f"{prefix}{name} is {json.dumps(theirs)} there and {json.dumps(ours)} in config.json"
    return None
