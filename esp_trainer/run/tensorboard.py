"""A TensorBoard log of a run: the numbers of ``metrics.jsonl`` and ``timing.jsonl`` as scalars."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from time import time
from typing import Any

from esp_trainer.files import naming
from predprey_env.extras import extra


class TensorBoardLog:
    """An event file in a directory. A resumed run adds another file; generations in both files have equal values.

    TensorBoard's own writer is not used: it keeps two minutes of events in memory, which a killed run would lose, and
    writes them in a thread whose errors are never raised.

    Raises :class:`gymnasium.error.DependencyNotInstalled` without the extra ``tensorboard``.
    """

    def __init__(self, directory: Path) -> None:
        check_tensorboard_installed()
        from tensorboard.summary.writer.record_writer import RecordWriter

        self._path = directory / f"events.out.tfevents.{time():.6f}.{os.getpid()}"
        with naming(directory):
            directory.mkdir(parents=True, exist_ok=True)
        with naming(self._path):
            self._file = self._path.open("xb")
        self._records = RecordWriter(self._file)
        self._write(file_version="brain.Event:2")

    def add(self, record: Mapping[str, Any], seconds: Mapping[str, float]) -> None:
        """Write a generation: its record of the log, and its wall seconds by phase."""
        values = [{"tag": name, "simple_value": n} for name, n in (*_scalars(record), *_scalars(seconds, "seconds/"))]
        self._write(step=record["generation"], summary={"value": values})

    def _write(self, **event: Any) -> None:
        from tensorboard.compat.proto.event_pb2 import Event

        with naming(self._path):
            self._records.write(Event(wall_time=time(), **event).SerializeToString())
            self._file.flush()

    def close(self) -> None:
        """Close the file."""
        with naming(self._path):
            self._file.close()


def check_tensorboard_installed() -> None:
    """Raise :class:`gymnasium.error.DependencyNotInstalled`, with the remedy, if TensorBoard is missing."""
    with extra("tensorboard", "a log for TensorBoard"):
        import tensorboard.summary  # noqa: F401


def _scalars(tree: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, float]]:
    """Yield the numbers of a tree with their paths; of a rate with an interval, the rate."""
    for name, value in tree.items():
        if isinstance(value, Mapping) and "rate" in value:
            yield prefix + name, value["rate"]
        elif isinstance(value, Mapping):
            yield from _scalars(value, f"{prefix}{name}/")
        elif isinstance(value, list):
            known = {str(i): each for i, each in enumerate(value) if each is not None}
            yield from _scalars(known, f"{prefix}{name}/")
        elif name != "generation" and value is not None:
            yield prefix + name, value
