"""Access to the zoo. Its index holds the digest of every file, so that a table identifies its teams."""

from __future__ import annotations

import difflib
import hashlib
import json
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from esp_trainer.arrays import Counts, PayoffMatrix
from esp_trainer.esp.team import Team
from esp_trainer.files import DamagedFileError, digest_of, read_arrays
from esp_trainer.statistics import Rate
from esp_trainer.types import Role

PLACE = Path(__file__).parent / "zoo"
"""Directory of the zoo's files."""
HELD_OUT_PREFIX = "held-out/"
"""Prefix of the names of teams that are for reporting only."""
FIRST_ZOO = ("paper", "modern", "drawn")
"""Presets, without the task, of the first zoo. Its held-out teams are a panel of their own, so that results can be
compared with older ones."""


@dataclass(frozen=True)
class ZooTeam:
    """A team's entry in the index."""

    name: str
    task: str
    """Name in :data:`esp_trainer.tasks.WORLDS`."""
    role: Role
    preset: str
    seed: int
    stage: str
    """``early``, ``middle`` or ``late``: the third of its run in which the team was the strongest."""
    generation: int
    score: Rate
    """Mean score against the zoo's opposing teams, with its interval over them. A predators' score is the fraction of
    prey caught, a prey's score the fraction not caught."""
    rating: Rate
    """Rating among all teams and scripts of the task, in points: 400 are ten to one (Bradley & Terry 1952)."""
    digest: str
    """SHA-256 of the team's file."""

    @classmethod
    def from_dict(cls, entry: dict[str, Any]) -> ZooTeam:
        """Return an entry from JSON values."""
        rates = {name: Rate(*entry[name]) for name in ("score", "rating")}
        return cls(**{**entry, **rates})

    @property
    def held_out(self) -> bool:
        """Return whether the team is for reporting only."""
        return self.name.startswith(HELD_OUT_PREFIX)


@dataclass(frozen=True)
class Zoo:
    """The teams of one task, and their results against each other."""

    task: str
    teams: tuple[ZooTeam, ...] = field(repr=False)
    predators: tuple[str, ...] = field(repr=False)
    """Names of the rows: teams, then scripts."""
    prey: tuple[str, ...] = field(repr=False)
    """Names of the columns: teams, then scripts."""
    captured: Counts = field(repr=False)
    """Number of prey caught in all episodes of each pair, from the same starts, int ``(n_predators, n_prey)``."""
    n_episodes: int
    """Number of episodes of each pair."""
    n_prey: int
    """Number of prey in each episode."""
    digest: str
    """SHA-256 of the index of the whole zoo."""

    @property
    def caught(self) -> PayoffMatrix:
        """Fraction of prey caught, float64 ``(n_predators, n_prey)``."""
        return self.captured / (self.n_episodes * self.n_prey)

    def names(self, role: Role) -> tuple[str, ...]:
        """Return the names of a role's teams and scripts: the rows, or the columns."""
        return self.predators if role == "predators" else self.prey


def load_team(name: str) -> Team:
    """Return a team of the zoo by its name (``esp-trainer teams`` lists them).

    Raises :class:`ValueError`, with the nearest names, for an unknown name; :class:`DamagedFileError` if its file is
    not the one that the index describes.
    """
    known = known_teams()
    if name not in known:
        raise ValueError(unknown("team", name, known))
    path = PLACE / f"{name}.safetensors"
    _check(path, known[name].digest)
    return Team.load(path)


def unknown(what: str, name: str, known: Iterable[str]) -> str:
    """Return the message for an unknown name, with the nearest known names."""
    near = difflib.get_close_matches(name, list(known), n=3, cutoff=0.4)
    listed = " or ".join([", ".join(near[:-1])] * bool(near[:-1]) + near[-1:])
    return f"unknown {what} {name}; " + (f"did you mean {listed}?" if near else "nothing is named like it")


def known_teams() -> dict[str, ZooTeam]:
    """Return every team of the zoo by name."""
    return {team.name: team for team in _index().teams}


@cache
def load_zoo(task: str) -> Zoo:
    """Return the teams of a task and their results against each other.

    Raises :class:`ValueError` for an unknown task; :class:`DamagedFileError` if the matrix is not the one that the
    index describes.
    """
    index = _index()
    if task not in index.matrices:
        raise ValueError(f"task must be one of {', '.join(index.matrices)}, got {task!r}")
    path = PLACE / f"cross-play-{task}.safetensors"
    _check(path, index.matrices[task])
    header, arrays = read_arrays(path, "zoo cross-play")
    return Zoo(
        task=task,
        teams=tuple(team for team in index.teams if team.task == task),
        predators=tuple(header["predators"]),
        prey=tuple(header["prey"]),
        captured=arrays["captured"],
        n_episodes=header["n_episodes"],
        n_prey=header["n_prey"],
        digest=index.digest,
    )


class _Index(NamedTuple):
    """The contents of ``index.json``."""

    teams: list[ZooTeam]
    matrices: dict[str, str]
    """SHA-256 of each task's matrix."""
    digest: str
    """SHA-256 of the index itself."""


@cache
def _index() -> _Index:
    path = PLACE / "index.json"
    data = path.read_bytes()
    try:
        told = json.loads(data)
        teams = list(map(ZooTeam.from_dict, told["teams"]))
        return _Index(teams, dict(told["matrices"]), hashlib.sha256(data).hexdigest())
    except (ValueError, KeyError, TypeError) as error:
        raise DamagedFileError(f"{path} is damaged: {error}") from None


def _check(path: Path, digest: str) -> None:
    if not path.is_file():
        raise FileNotFoundError(f"{path} is not there: the package is not installed whole")
    if digest_of(path) != digest:
        raise DamagedFileError(f"{path} was altered: it is not the file that the zoo's index describes")
