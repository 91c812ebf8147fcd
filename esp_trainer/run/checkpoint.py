"""Checkpoints: the state that the next generation depends on, in one file."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from esp_trainer.algorithm import Algorithm
from esp_trainer.algorithms.registry import algorithm_name, failures_told, state_of
from esp_trainer.arrays import StoredArray, TeamGenomes
from esp_trainer.coevolution.hall_of_fame import HallOfFame, kept_generations
from esp_trainer.coevolution.league import NO_LEAGUE, League
from esp_trainer.coevolution.sides import EvolvingSide, Side, new_hall_of_fame, new_sides, side_config
from esp_trainer.config import RunConfig
from esp_trainer.files import DamagedFileError, read_arrays, write_arrays
from esp_trainer.types import ROLES, Role, ScriptedTeams
from predprey_env.settings import PartError

NO_MATTER = ("generations", "checkpoint_every", "genealogy")
"""Settings that affect no generation."""


class OtherConfigError(ValueError):
    """A checkpoint was written with another config."""


def save_checkpoint(path: Path, config: RunConfig, sides: dict[Role, Side], generations: int) -> None:
    """Write the state after a number of generations."""
    arrays: dict[str, StoredArray] = {}
    progress: dict[str, Any] = {}
    for role, side in sides.items():
        if isinstance(side, EvolvingSide):
            arrays |= {f"{role}.{name}": array for name, array in state_of(side.algorithm).items()}
            fame, n_guests = side.hall_of_fame, len(side.hall_of_fame.guests)
            arrays[f"{role}.hall_of_fame"] = fame.champions
            arrays[f"{role}.met"] = fame.met[n_guests:]
            if config.esp.exploiters_every:
                arrays[f"{role}.guests"] = fame.guests
            if n_guests:
                arrays[f"{role}.guests_met"] = fame.met[:n_guests]
            best = side.best if np.isfinite(side.best) else None
            progress[role] = {"best": best, "stagnant": side.stagnant}
    algorithms = {role: _algorithm(side) for role, side in sides.items()}
    header = {
        "config": config.model_dump(exclude={"genealogy"}),  # the same bytes with and without it
        "generations": generations,
        "sides": progress,
        "algorithms": algorithms,
    }
    write_arrays(path, "checkpoint", header, arrays)


def load_checkpoint(path: Path, config: RunConfig, league: League = NO_LEAGUE) -> tuple[dict[Role, Side], int]:
    """Return both sides, and the number of generations that they have completed.

    Only a run that is resumed needs its league. Without it the halls of fame hold the run's own champions alone.
    """
    with _usable(path):
        header, arrays = _read(path, config)
        generations, progress = int(header["generations"]), header["sides"]
    sides = new_sides(config, league)  # if a class of the user's cannot be imported, the file is not to blame
    with _usable(path):
        for role, side in sides.items():
            if isinstance(side, EvolvingSide):
                # Before the algorithm: if a network has other genes now, the error here names the network.
                fame = _hall_of_fame(side.hall_of_fame, role, config, arrays, generations)
                _restore_algorithm(side.algorithm, role, arrays)
                best = progress[role]["best"]
                best = -np.inf if best is None else float(best)
                sides[role] = EvolvingSide(side.algorithm, fame, best, int(progress[role]["stagnant"]))
    return sides, generations


def load_champions(path: Path, config: RunConfig) -> tuple[dict[Role, TeamGenomes], int]:
    """Return the champions in the hall of fame of each evolving side, and the number of completed generations.

    The algorithms are not restored, because an optimiser whose calls are repeated would take seconds.
    """
    with _usable(path):
        header, arrays = _read(path, config)
        generations = int(header["generations"])
    evolving = [role for role in ROLES if side_config(config, role).policy == "esp"]
    empty = {role: new_hall_of_fame(config, role) for role in evolving}
    with _usable(path):
        halls = {role: _hall_of_fame(fame, role, config, arrays, generations) for role, fame in empty.items()}
    return {role: fame.champions.copy() for role, fame in halls.items()}, generations


def generations_in(path: Path, config: RunConfig) -> int:
    """Return the number of generations that a checkpoint has completed; 0 if there is no checkpoint."""
    if not path.exists():
        return 0
    with _usable(path):
        return int(_read(path, config)[0]["generations"])


def _read(path: Path, config: RunConfig) -> tuple[dict[str, Any], dict[str, StoredArray]]:
    header, arrays = read_arrays(path, "checkpoint")
    different = difference(RunConfig.from_dict(header.get("config", {})).model_dump(), config.model_dump())
    if different:
        raise OtherConfigError(f"{path} belongs to another config: {different} in config.json")
    return header, arrays


@contextmanager
def _usable(path: Path) -> Iterator[None]:
    """Raise errors in the contents of a checkpoint with its path."""
    try:
        yield
    except (OtherConfigError, DamagedFileError, PartError):
        raise
    except KeyError as error:
        raise DamagedFileError(f"{path} is not a usable checkpoint: {error.args[0]} is missing") from None
    except (TypeError, ValueError) as error:
        raise DamagedFileError(f"{path} is not a usable checkpoint: {error}") from None


def check_algorithms(path: Path, config: RunConfig) -> None:
    """Raise :class:`ValueError` if another algorithm than the config names bred or played a side of a checkpoint."""
    for role, saved in read_arrays(path, "checkpoint")[0].get("algorithms", {}).items():
        ours = _configured(config, role)
        if saved != ours:
            raise ValueError(f"{path}: the {role} come from {saved}, and resume can go on with {ours} only")


def follow_from(config: RunConfig, sides: dict[Role, Side]) -> bool:
    """Return whether the sides have the algorithms and scripts that the config names."""
    return all(_algorithm(side) == _configured(config, role) for role, side in sides.items())


def _configured(config: RunConfig, role: Role) -> str:
    """Return the name of the algorithm that breeds a side, or of the script that plays it, by the config."""
    settings = side_config(config, role)
    return settings.algorithm if settings.policy == "esp" else settings.policy


def _algorithm(side: Side) -> str:
    """Return the name of what breeds or plays a side: an algorithm, a script, or a user's class."""
    if isinstance(side, ScriptedTeams):
        return side.script
    return algorithm_name(side.algorithm if isinstance(side, EvolvingSide) else side)


def _hall_of_fame(
    empty: HallOfFame, role: Role, config: RunConfig, arrays: dict[str, StoredArray], generations: int
) -> HallOfFame:
    """Return a side's hall of fame from a checkpoint; ``empty`` is that of the first generation."""
    fame = arrays[f"{role}.hall_of_fame"]
    kept, size = kept_generations(generations, config.esp.hof_size), config.esp.hof_size
    met = arrays.get(f"{role}.met", np.zeros((len(fame), 2)))  # older checkpoints have none
    _check(f"{role}.met", met, (len(fame), 2), np.float64)
    if len(fame) == generations:  # written before halls of fame were bounded
        fame, met = fame[kept], met[kept]
    networks = f"{role}.hall_of_fame of {side_config(config, role).network} networks"
    _check(networks, fame, (len(kept), *empty.champions.shape[1:]))
    guests = empty.guests  # those of the league; with exploiters, the checkpoint holds all guests
    if config.esp.exploiters_every:
        guests = arrays[f"{role}.guests"]
        _check(f"{role}.guests", guests, (len(guests), *empty.champions.shape[1:]))
    guests_met = arrays[f"{role}.guests_met"] if len(guests) else np.zeros((0, 2))
    _check(f"{role}.guests_met", guests_met, (len(guests), 2), np.float64)
    return HallOfFame(fame, size, generations, np.vstack([guests_met, met]), guests)


def _restore_algorithm(algorithm: Algorithm, role: Role, arrays: dict[str, StoredArray]) -> None:
    prefix = f"{role}."
    state = {name.removeprefix(prefix): array for name, array in arrays.items() if name.startswith(prefix)}
    try:
        with failures_told(algorithm_name(algorithm), "restore()"):
            algorithm.restore(state)
    except PartError:
        raise
    except ValueError as error:
        raise ValueError(f"{prefix}{error}") from None
    except KeyError as error:
        raise KeyError(f"{prefix}{error.args[0]}") from None


def _check(name: str, array: StoredArray, shape: tuple[int, ...], kind: type[np.floating[Any]] = np.float32) -> None:
    if array.shape != shape or array.dtype != kind:
        raise ValueError(f"{name} must be {kind.__name__} of shape {shape}, got {array.dtype} of shape {array.shape}")


def difference(saved: dict[str, Any], wanted: dict[str, Any], prefix: str = "") -> str | None:
    """Return the first setting that differs between two configs, with both values; None if there is none.

    Settings that affect no generation are ignored.
    """
    for name in {**saved, **wanted}:
        ours, theirs = wanted.get(name), saved.get(name)
        if isinstance(ours, dict) and isinstance(theirs, dict):
            inner = difference(theirs, ours, f"{prefix}{name}.")
            if inner:
                return inner
        elif ours != theirs and prefix + name not in NO_MATTER:
            return f"{prefix}{name} is {json.dumps(theirs)} there and {json.dumps(ours)}"
    return None
