"""Running the arms: each run on one core, as many at once as there are cores, none twice."""

from __future__ import annotations

import os
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path

from tqdm import tqdm

from esp_trainer import RunConfig
from esp_trainer.analysis.history import History
from esp_trainer.evaluation.fused import FusedEvaluator
from reproduction.arms import Arm


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
    if not todo:
        return
    total = sum(arm.config.generations for arm, _ in todo)
    with (
        tqdm(total=total, unit="gen", desc="evolving") as bar,
        ProcessPoolExecutor(workers, get_context("spawn"), initializer=_give_way) as pool,
    ):
        runs = {pool.submit(_run, arm.run(seed), history_file(place, arm, seed)): arm for arm, seed in todo}
        try:
            for run in as_completed(runs):
                run.result()
                bar.update(runs[run].config.generations)
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def _give_way() -> None:
    """Leave the machine usable for hours of this."""
    if hasattr(os, "nice"):
        os.nice(5)


def _run(config: RunConfig, path: Path) -> None:
    history = History.evolve(config, FusedEvaluator(config.env, threads=1))
    path.parent.mkdir(parents=True, exist_ok=True)
    history.save(path)
