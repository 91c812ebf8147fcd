"""The runs of a plan, done to the end in processes of this machine."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from esp_trainer.sweep.local import LocalPool
from esp_trainer.sweep.plan import PlannedRun
from esp_trainer.sweep.pool import Work
from esp_trainer.sweep.results import is_whole


def run_all(place: Path, runs: Sequence[PlannedRun], n_workers: int) -> None:
    """Do the runs that are not whole, as ``esp-trainer sweep`` does, and say which are done.

    Raises :class:`RuntimeError` if one of them fails; those in progress then stop.
    """
    todo = [run for run in runs if not is_whole(place / run.name, run)]
    if not todo:
        return
    place.mkdir(parents=True, exist_ok=True)
    pool = LocalPool([Work(place / run.name, run.config) for run in todo], n_workers)
    left = len(todo)
    try:
        while left:
            for path, reason in pool.outcomes(1.0):
                if reason:
                    raise RuntimeError(f"{path} failed: {reason}")
                left -= 1
                print(f"{path.name}: done, {left} left", file=sys.stderr, flush=True)
    except BaseException:
        pool.stop()
        raise
    finally:
        pool.close()
