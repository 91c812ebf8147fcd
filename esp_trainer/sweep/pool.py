"""What a sweep asks of those who carry out its runs."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple, Protocol

from esp_trainer.config import RunConfig


class Work(NamedTuple):
    """A run to do."""

    path: Path
    config: RunConfig


class Outcome(NamedTuple):
    """A run that is whole, or failed."""

    path: Path
    reason: str | None
    """Why it failed; None if it did not."""


class Pool(Protocol):
    """Does runs, as many at a time as it has workers."""

    def outcomes(self, timeout: float) -> list[Outcome]:
        """What has ended since the last call; waits up to so many seconds for something to."""
        ...

    def stop(self) -> None:
        """Let nobody begin another run; those in hand end as soon as they can, and can be gone on with."""
        ...

    def close(self) -> None:
        """Leave nobody behind."""
        ...
