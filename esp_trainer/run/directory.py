"""Where a run keeps itself.

| file                                | what                                                                     |
|-------------------------------------|--------------------------------------------------------------------------|
| ``config.json``                     | the config, and the versions that wrote it                               |
| ``metrics.jsonl``                   | a line for each generation, the same however the run was stopped         |
| ``timing.jsonl``                    | wall seconds of each generation, by phase                                |
| ``checkpoint.safetensors``          | all that the next generation follows from                                |
| ``champions/predators-00041.safetensors`` | each generation's champion of each side                            |
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from esp_trainer.config import RunConfig
from esp_trainer.files import SCHEMA, DamagedFileError, to_json, write
from esp_trainer.types import Role


class RunDirectory:
    """The files of one run."""

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self.config_file = self.path / "config.json"
        self.metrics_file = self.path / "metrics.jsonl"
        self.timing_file = self.path / "timing.jsonl"
        self.checkpoint_file = self.path / "checkpoint.safetensors"
        self.champions = self.path / "champions"

    def create(self, config: RunConfig) -> None:
        """Begin a run here; a directory that holds anything already is left as it is and refused."""
        if self.config_file.exists():
            raise FileExistsError(f"{self.path} already holds a run; resume it, or choose another directory")
        if self.path.exists() and (not self.path.is_dir() or any(self.path.iterdir())):
            raise FileExistsError(f"{self.path} is not an empty directory, and holds no run")
        self.champions.mkdir(parents=True, exist_ok=True)
        self.write_config(config)

    def write_config(self, config: RunConfig) -> None:
        """Put the config in place."""
        whole = {"schema": SCHEMA, "version": version("predprey-esp"), "config": config.model_dump()}
        write(self.config_file, to_json(whole))

    def read_config(self) -> RunConfig:
        """The run's config."""
        if not self.config_file.is_file():
            raise FileNotFoundError(f"{self.path} holds no run: there is no config.json")
        try:
            whole = json.loads(self.config_file.read_bytes())
            if whole["schema"] != SCHEMA:
                raise ValueError(f"schema must be {SCHEMA}, got {whole['schema']!r}")
            return RunConfig.from_dict(whole["config"])
        except (KeyError, TypeError, ValueError, RecursionError) as error:
            raise DamagedFileError(f"{self.config_file} is damaged: {error}") from None

    def champion_file(self, role: Role, generation: int) -> Path:
        """Where a generation's champion is."""
        return self.champions / f"{role}-{generation:05d}.safetensors"

    def rewind(self, generations: int) -> None:
        """Bring the logs back to a checkpoint after that many generations, and drop what was half written."""
        self.champions.mkdir(exist_ok=True)
        for leftover in (*self.path.glob(".*.part"), *self.champions.glob(".*.part")):
            leftover.unlink()
        kept = whole_lines(self.metrics_file)[:generations]
        if len(kept) < generations:
            raise DamagedFileError(f"{self.metrics_file} must hold {generations} whole lines, got {len(kept)}")
        write(self.metrics_file, b"".join(kept))
        write(self.timing_file, b"".join(whole_lines(self.timing_file)[:generations]))


class Log:
    """A file of JSON lines, one for each generation."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("ab")

    def append(self, record: dict[str, Any]) -> None:
        """Add a line."""
        self._file.write(json.dumps(record, allow_nan=False).encode() + b"\n")
        self._file.flush()

    def sync(self) -> None:
        """Wait until all lines are on disk."""
        os.fsync(self._file.fileno())

    def close(self) -> None:
        """Let the file go."""
        self._file.close()


def whole_lines(path: Path) -> Sequence[bytes]:
    """The lines of a log, without one that was cut off; none if there is no such file."""
    if not path.exists():
        return []
    return [line for line in path.read_bytes().splitlines(keepends=True) if line.endswith(b"\n")]
