"""Runs on a Ray cluster."""

from __future__ import annotations

import socket
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from esp_trainer import cluster
from esp_trainer.config import RunConfig
from esp_trainer.sweep.pool import Outcome, Work
from esp_trainer.sweep.work import carry_out

_GRACE = 5.0  # seconds that cancelled runs have to end


class ClusterPool:
    """Tasks on the cluster that this process is connected to; see :class:`~esp_trainer.sweep.pool.Pool`.

    Every node must see the directory of the runs. If a node dies, its run resumes on another, from its checkpoint.
    """

    def __init__(self, runs: Sequence[Work]) -> None:
        self._tasks: dict[Any, Path] = {
            cluster.submit(_carry_out_there, str(run.path.resolve()), run.config.model_dump()): run.path for run in runs
        }

    def outcomes(self, timeout: float) -> list[Outcome]:
        """Return the runs that have ended."""
        return [self._outcome(task) for task in cluster.ended(list(self._tasks), timeout)]

    def _outcome(self, task: Any) -> Outcome:
        path = self._tasks.pop(task)
        try:
            (reason,) = cluster.gather([task])
        except (ValueError, OSError) as error:
            reason = str(error)
        return Outcome(path, reason)

    def stop(self) -> None:
        """End all runs at once. They can be resumed from their last checkpoints."""
        cluster.cancel(list(self._tasks), _GRACE)
        self._tasks.clear()

    def close(self) -> None:
        """Stop the runs that are left."""
        self.stop()


def _carry_out_there(path: str, config: dict[str, Any]) -> str | None:
    """Carry out a run on a worker of some node. Return None, or why it failed."""
    place = Path(path)
    if not place.parent.is_dir():
        host = socket.gethostname()
        return f"node {host} does not see {place.parent}: the runs of a sweep need a directory that all nodes share"
    return carry_out(place, RunConfig.from_dict(config))
