"""What a run of very many generations keeps on disk, generation after generation."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.presets import preset
from esp_trainer.run.directory import RunDirectory
from esp_trainer.run.trainer import Trainer


class Kept(NamedTuple):
    """After so many generations."""

    generations: int
    champions: int
    """Of a side."""
    memory: float
    """Megabytes of both halls of fame."""
    files: float
    """Megabytes of the champions' files, in whole blocks."""
    checkpoint: float
    """Megabytes."""
    logs: float
    """Megabytes."""


def measure(generations: int) -> list[Kept]:
    """A run with the networks of ``paper-3v2``, and otherwise as little as possible, at each tenth of its length."""
    paper = preset("paper-3v2")
    config = paper.replace(
        generations=generations,
        checkpoint_every=min(10, generations // 10),
        env=paper.env.replace(max_cycles=5),
        esp=paper.esp.replace(n_trials=16, n_episodes=1),
        champion=paper.champion.replace(n_candidates=2, n_held_out=8),
    )
    with TemporaryDirectory() as place:
        trainer = Trainer.start(RunDirectory(Path(place) / "run"), config, lambda c: FusedEvaluator(c.env, threads=1))
        tenths = (trainer.done % (generations // 10) == 0 for _ in trainer.generations())
        return [_kept(trainer) for tenth in tenths if tenth]


def _kept(trainer: Trainer) -> Kept:
    directory, sides = trainer.directory, trainer.coevolution.evolving.values()
    files = [file.stat() for file in directory.champions.iterdir()]
    logs = [file.stat().st_size for file in (directory.metrics_file, directory.timing_file)]
    return Kept(
        trainer.done,
        max(len(side.hall_of_fame) for side in sides),
        sum(side.hall_of_fame.champions.nbytes for side in sides) / 1e6,
        sum(512 * stat.st_blocks for stat in files) / 1e6,
        directory.checkpoint_file.stat().st_size / 1e6,
        sum(logs) / 1e6,
    )
