"""Conditions, groups of runs that differ only in their seeds: their names, and checks that their teams can meet."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from esp_trainer.analysis.pooling import MAY_DIFFER
from esp_trainer.config import RunConfig
from esp_trainer.types import ROLES
from predprey_env.config import PAYOFF, SIGHT, EnvConfig
from predprey_env.settings import flat

_Fields = dict[str, Any]


def world_of(env: EnvConfig) -> _Fields:
    """Return the fields of a world that decide which teams can play in it and which prey are caught.

    Teams trained on different payoffs, and teams that see differently, can still play each other.
    """
    return env.model_dump(exclude={*PAYOFF, *SIGHT})


def check_same_world(runs: Sequence[tuple[Path, RunConfig]]) -> None:
    """Raise :class:`ValueError` unless the runs have the same world, so their teams can meet. Payoffs may differ."""
    (first_path, first), *others = runs
    wanted = world_of(first.env)
    for path, config in others:
        if config.game != first.game:
            games = [each.game.environment or "the predator-prey world" for each in (first, config)]
            with_options = (
                f" with options {first.game.options} and {config.game.options}" if games[0] == games[1] else ""
            )
            raise ValueError(
                f"runs must be of one game, so that their teams can meet, got {games[0]} in {first_path} and "
                f"{games[1]} in {path}{with_options}"
            )
        for name, value in world_of(config.env).items():
            if value != wanted[name]:
                raise ValueError(
                    f"runs must be of one world, so that their teams can meet, got {first_path} with "
                    f"env.{name}={wanted[name]} and {path} with env.{name}={value}"
                )


def conditions(configs: Sequence[RunConfig], given: Sequence[str | None] | None = None) -> dict[str, list[int]]:
    """Group runs by condition.

    Args:
        configs: Configs of the runs.
        given: Name of each run's condition in its sweep's file; None for a run without. These names are used only if
            every condition has exactly one and all are different.

    Returns:
        Name of each condition -> indices of its runs, in order of first appearance.
    """
    fields = [_comparable(config) for config in configs]
    distinct = [each for i, each in enumerate(fields) if each not in fields[:i]]
    members = [[i for i, each in enumerate(fields) if each == condition] for condition in distinct]
    if given and (named := _given_names([{given[i] for i in indices} for indices in members])):
        return dict(zip(named, members, strict=True))
    # Runs of a condition may come from presets with different names: use that of the first run.
    names = _names([configs[indices[0]].preset for indices in members], _with_sides_merged(distinct))
    return dict(zip(names, members, strict=True))


def _given_names(names: Sequence[set[str | None]]) -> list[str] | None:
    """Return the name of each condition; None unless each has exactly one name, and all names are different."""
    single = [name for each in names if len(each) == 1 and (name := next(iter(each))) is not None]
    return single if len(set(single)) == len(names) else None


def _comparable(config: RunConfig) -> _Fields:
    league = config.league[:8] or "none"  # all 64 digits of the hash would be too long for a name
    return flat(config.model_dump(exclude=MAY_DIFFER)) | {"league": league}


def _with_sides_merged(fields: Sequence[_Fields]) -> list[_Fields]:
    """Return the fields with the side's name removed from those that are equal for both sides in every condition."""

    def merged(name: str) -> str:
        side, _, leaf = name.partition(".")
        alike = side in ROLES and all(each[f"predators.{leaf}"] == each[f"prey.{leaf}"] for each in fields)
        return leaf if alike else name

    return [{merged(name): value for name, value in each.items()} for each in fields]


def _names(presets: Sequence[str], fields: Sequence[_Fields]) -> list[str]:
    """Return a name for each condition.

    The names are the presets if these are all different. Else they are the fields that differ, or the preset and the
    fields that differ within a preset, whichever names are shorter in total.
    """
    if len(set(presets)) == len(presets):
        return list(presets)
    apart = _differing(fields)
    within = {
        name
        for preset in presets
        for name in _differing([f for p, f in zip(presets, fields, strict=True) if p == preset])
    }
    by_fields = [_in_words(each, apart) for each in fields]
    by_both = [
        ", ".join([preset, _in_words(each, [name for name in apart if name in within])])
        for preset, each in zip(presets, fields, strict=True)
    ]
    return min(by_fields, by_both, key=lambda names: sum(map(len, names)))


def _differing(fields: Sequence[_Fields]) -> list[str]:
    """Return the names of the fields that are not the same in all conditions, in the order of the config."""
    first = fields[0]
    return [name for name in first if any(each[name] != first[name] for each in fields)]


def _in_words(fields: _Fields, names: Iterable[str]) -> str:
    return ", ".join(f"{name}={_value(fields[name])}" for name in names)


def _value(value: Any) -> str:
    """Return a value as it is written in a sweep's file; 0.0 becomes 0."""
    return str(value).lower() if isinstance(value, bool) else str(value).removesuffix(".0")
