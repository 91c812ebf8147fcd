"""Running the arms: each run on one core, as many at once as there are cores, none twice."""

from __future__ import annotations

import os
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import Manager, get_context
from pathlib import Path
from queue import Empty
from typing import Any

from tqdm import tqdm

from esp_trainer import RunConfig
from esp_trainer.analysis.history import History
from esp_trainer.evaluation.fused import FusedEvaluator
from reproduction.arms import Arm

_STEP = 10  # generations between two reports of a worker


def history_file(place: Path, arm: Arm, seed: int) -> Path:
    """Where a run is kept."""
    return place / arm.name / f"seed-{seed}.safetensors"


def missing(place: Path, arms: Iterable[Arm]) -> list[tuple[Arm, int]]:
    """The runs that are not there yet, or that another config made."""
    runs = [(arm, seed) for arm in arms for seed in arm.seeds]
    return [(arm, seed) for arm, seed in runs if not _is_there(history_file(place, arm, seed), arm.run(seed))]


def _is_there(path: Path, config: RunConfig) -> bool:
    return path.exists() and History.load(path).config == config


def evolve(place: Path, arms: Iterable[Arm], workers: int) -> None:
    """Run what is missing, with one progress bar over all of it; what is finished stays, whatever happens."""
    todo = missing(place, arms)
    total = sum(arm.config.generations for arm, _ in todo)
    with Manager() as manager, tqdm(total=total, unit="gen", smoothing=0.02, mininterval=2.0) as bar:
        reports = manager.Queue()
        with ProcessPoolExecutor(workers, get_context("spawn"), initializer=os.nice, initargs=(5,)) as pool:
            runs = {pool.submit(_run, arm.run(s), history_file(place, arm, s), reports): arm.name for arm, s in todo}
            try:
                for run in as_completed(runs):
                    run.result()
                    bar.set_description_str(runs[run], refresh=False)
                    bar.update(_drain(reports))
            except BaseException:
                pool.shutdown(cancel_futures=True)
                raise


def _drain(reports: Any) -> int:
    """Generations that workers have reported since the last look."""
    n = 0
    while True:
        try:
            n += reports.get_nowait()
        except Empty:
            return n


def _run(config: RunConfig, path: Path, reports: Any) -> None:
    counted = iter(range(1, config.generations + 1))

    def watch() -> None:
        if next(counted) % _STEP == 0:
            reports.put(_STEP)

    history = History.evolve(config, FusedEvaluator(config.env, threads=1), watch)
    path.parent.mkdir(parents=True, exist_ok=True)
    history.save(path)
