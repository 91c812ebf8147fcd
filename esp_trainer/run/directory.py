"""The directory of a run.

| file                                | what                                                                     |
|-------------------------------------|--------------------------------------------------------------------------|
| ``config.json``                     | the config, and the versions that wrote it                               |
| ``metrics.jsonl``                   | a line for each generation, the same after any interruption              |
| ``timing.jsonl``                    | wall seconds of each generation, by phase                                |
| ``checkpoint.safetensors``          | the state that the next generation depends on                            |
| ``league.safetensors``              | champions of other runs in the opponent pools, if there are any          |
| ``champions/predators-00041.safetensors`` | each generation's champion of each side; see ``esp.hof_size`` |
| ``genealogy/predators.bin``         | the parents of every neuron of each side, if ``genealogy`` is set        |
"""

from __future__ import annotations

import json
from collections.abc import Collection, Sequence
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path
from typing import Any

from esp_trainer.coevolution.league import NO_LEAGUE, League
from esp_trainer.config import RunConfig
from esp_trainer.files import SCHEMA, DamagedFileError, naming, sync, sync_directory, to_json, write
from esp_trainer.run.lock import Lock
from esp_trainer.types import ROLES, Role
from predprey_env.settings import PartError


def versions() -> dict[str, str]:
    """Return the versions that a run's numbers depend on besides its config: the rules, and NumPy's random streams."""
    return {name: version(name) for name in ("predprey-esp", "numpy")}


class RunDirectory:
    """The files of one run."""

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self.config_file = self.path / "config.json"
        self.metrics_file = self.path / "metrics.jsonl"
        self.timing_file = self.path / "timing.jsonl"
        self.checkpoint_file = self.path / "checkpoint.safetensors"
        self.league_file = self.path / "league.safetensors"
        self.champions = self.path / "champions"
        self.genealogy = self.path / "genealogy"
        self._lock: Lock | None = None
        self._made: list[Path] = []

    def create(self, config: RunConfig, league: League = NO_LEAGUE) -> Lock:
        """Begin a run in this directory, and return its lock. Refuse a directory that already holds something."""
        self._check_free()
        try:
            self._make(self.path)
            lock = self.lock()
            self._check_free()  # another run may have started before this one got the lock
            self._make(self.champions)
            self._write_league(league)  # before the config, which makes the run resumable
            self.write_config(config)
            self._made.append(self.config_file)
        except BaseException:  # Ctrl-C included
            self.discard()
            raise
        return lock

    def _write_league(self, league: League) -> None:
        for leftover in (self.league_file, *self.path.glob(".*.part")):  # left by a start that was killed
            leftover.unlink(missing_ok=True)
        if league.genomes:
            self._made.append(self.league_file)
            league.save(self.league_file)
            sync_directory(self.path)  # otherwise a power cut could leave a config without its league

    def _check_free(self) -> None:
        if self.config_file.exists():
            raise FileExistsError(f"{self.path} already holds a run; resume it, or choose another directory")
        if self.path.exists() and (not self.path.is_dir() or any(map(self._matters, self.path.iterdir()))):
            raise FileExistsError(f"{self.path} is not an empty directory, and holds no run")

    def _make(self, directory: Path) -> None:
        if not directory.exists():
            directory.mkdir(parents=True)
            self._made.append(directory)

    def _matters(self, entry: Path) -> bool:
        """Return whether a file is more than the remains of a start that was killed."""
        if entry == self.champions and entry.is_dir():
            return any(entry.iterdir())
        if entry == self.league_file:
            return not self.champions.is_dir()  # a start makes champions/ before the league
        return entry.name not in {f".{file.name}.part" for file in (self.config_file, self.league_file)}

    def discard(self) -> None:
        """Undo :meth:`create`, as far as it got."""
        for path in reversed(self._made):
            with suppress(OSError):
                path.rmdir() if path.is_dir() else path.unlink()
        self._made.clear()
        self.unlock()

    def lock(self) -> Lock:
        """Lock the directory until this process ends, the lock is released, or :meth:`unlock` is called."""
        self._lock = Lock(self.path)
        return self._lock

    def unlock(self) -> None:
        """Release the lock."""
        if self._lock is not None:
            self._lock.release()
            self._lock = None

    def __getstate__(self) -> dict[str, Any]:
        """Leave the lock out of copies and pickles, as only one object holds it."""
        return self.__dict__ | {"_lock": None, "_made": []}

    def __del__(self) -> None:
        self.unlock()

    def write_config(self, config: RunConfig) -> None:
        """Write the config and the versions."""
        whole = {"schema": SCHEMA, "versions": versions(), "config": config.model_dump()}
        write(self.config_file, to_json(whole))

    def read_config(self) -> RunConfig:
        """Return the config of the run.

        Raises:
            FileNotFoundError: There is no run.
            PartError: The config names a class of the user's that cannot be used.
            DamagedFileError: The config cannot be read.
        """
        if not self.config_file.is_file():
            runs = sorted(file.parent for file in self.path.glob("*/config.json"))
            inside = f"; name one of its {len(runs)} runs, such as {runs[0]}" if runs else ""
            raise FileNotFoundError(f"{self.path} holds no run: there is no config.json{inside}")
        try:
            whole = json.loads(self.config_file.read_bytes())
            if whole["schema"] != SCHEMA:
                raise ValueError(f"schema must be {SCHEMA}, got {whole['schema']!r}")
            return RunConfig.from_dict(whole["config"])
        except KeyError as error:
            raise DamagedFileError(f"{self.config_file} is damaged: {error.args[0]} is missing") from None
        except PartError as error:
            raise PartError(f"{self.path}: {error}") from None
        except (TypeError, ValueError, RecursionError) as error:
            raise DamagedFileError(f"{self.config_file} is damaged: {error}") from None

    def read_league(self, config: RunConfig) -> League:
        """Return the league that the run began with."""
        return League.load(self.league_file, config.league)

    def begun_with(self) -> dict[str, str]:
        """Return the versions that the run began with."""
        found = json.loads(self.config_file.read_bytes()).get("versions", {})
        return found if isinstance(found, dict) else {}

    def champion_file(self, role: Role, generation: int) -> Path:
        """Return the path of a generation's champion."""
        return self.champions / f"{role}-{generation:05d}.safetensors"

    def genealogy_file(self, role: Role) -> Path:
        """Return the path of a side's genealogy."""
        return self.genealogy / f"{role}.bin"

    def rewind(self, generations: int) -> None:
        """Go back to a checkpoint after some generations: delete later lines and champions, and half-written files."""
        kept = whole_lines(self.metrics_file)[:generations]
        if len(kept) < generations:
            raise DamagedFileError(f"{self.metrics_file} must hold {generations} whole lines, got {len(kept)}")
        for number, line in enumerate(kept):
            if _generation(line) != number:
                raise DamagedFileError(f"{self.metrics_file} is damaged: line {number + 1} is not generation {number}")
        self.champions.mkdir(exist_ok=True)
        for leftover in (*self.path.glob(".*.part"), *self.champions.glob(".*.part")):
            leftover.unlink()
        self.keep_champions(range(generations))
        write(self.metrics_file, b"".join(kept))
        # A kill after a checkpoint may have lost a line of this log, so lines are found by generation, not by place.
        timed = [line for line in whole_lines(self.timing_file) if _generation(line) in range(generations)]
        write(self.timing_file, b"".join(timed))

    def champion_generations(self, role: Role) -> list[int]:
        """Return the generations that have a champion's file, in order."""
        names = (file.stem.rpartition("-")[2] for file in self.champions.glob(f"{role}-*.safetensors"))
        return sorted(int(name) for name in names if name.isdecimal())

    def keep_champions(self, generations: Collection[int]) -> None:
        """Delete the champions of all other generations."""
        for role in ROLES:
            for generation in self.champion_generations(role):
                if generation not in generations:
                    self.champion_file(role, generation).unlink()


class Log:
    """A file of records, one for each generation."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file = path.open("ab")

    def append(self, record: dict[str, Any]) -> None:
        """Add a line of JSON."""
        self.write(json.dumps(record, allow_nan=False).encode() + b"\n")

    def write(self, record: bytes) -> None:
        """Add a record."""
        with naming(self._path):
            self._file.write(record)
            self._file.flush()

    def sync(self) -> None:
        """Wait until all records are on disk, where the system can."""
        with naming(self._path):
            sync(self._file.fileno())

    def close(self) -> None:
        """Close the file."""
        with naming(self._path):
            self._file.close()


class Tail:
    """Reads the new lines of a log that another process writes."""

    def __init__(self, path: Path) -> None:
        self._path, self._read = path, 0

    def look(self) -> tuple[list[bytes], bool]:
        """Return the whole lines since the last call, or all lines if the log was cut, and whether it was cut."""
        size = self._path.stat().st_size if self._path.exists() else 0
        cut = size < self._read  # resumed from an earlier checkpoint
        if cut:
            self._read = 0
        if size == self._read:
            return [], cut
        with self._path.open("rb") as file:
            file.seek(self._read)
            new = [line for line in file.read(size - self._read).splitlines(keepends=True) if line.endswith(b"\n")]
        self._read += sum(map(len, new))
        return new, cut


def whole_lines(path: Path) -> Sequence[bytes]:
    """Return the lines of a log without a last line that was cut off; none if the file does not exist."""
    if not path.exists():
        return []
    return [line for line in path.read_bytes().splitlines(keepends=True) if line.endswith(b"\n")]


def records(log: Path) -> list[dict[str, Any]]:
    """Return the records of a log, up to the first damaged line."""
    found: list[dict[str, Any]] = []
    for line in whole_lines(log):
        if _generation(line) != len(found):
            break
        found.append(json.loads(line))
    return found


def _generation(line: bytes) -> Any:
    try:
        return json.loads(line)["generation"]
    except (ValueError, TypeError, KeyError, RecursionError):
        return None
