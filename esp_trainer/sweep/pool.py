"""The interface between a sweep and the pools that carry out its runs."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple, Protocol

from esp_trainer.config import RunConfig


class Work(NamedTuple):
    """A run to carry out."""

    path: Path
    config: RunConfig


class Outcome(NamedTuple):
    """A run that is complete, or failed."""

    path: Path
    reason: str | None
    """Reason of the failure; None for a run that is complete."""


class Pool(Protocol):
    """Carries out runs, as many at a time as it has workers."""

    def outcomes(self, timeout: float) -> list[Outcome]:
        """Return the runs that have ended since the last call. Wait up to ``timeout`` seconds for the first of them."""
        ...

    def stop(self) -> None:
        """Begin no more runs. Running ones end as soon as they can, and can be resumed."""
        ...

    def close(self) -> None:
        """End all workers that are left."""
        ...
