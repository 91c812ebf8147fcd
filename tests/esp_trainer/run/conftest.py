"""Runs to compare: short ones in this process, and what is on disk after them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.presets import preset
from esp_trainer.run.directory import RunDirectory
from esp_trainer.run.trainer import Trainer

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from esp_trainer.config import RunConfig

Snapshot = dict[str, bytes]


def _evaluator(config: RunConfig) -> FusedEvaluator:
    return FusedEvaluator(config.env, threads=2)


@pytest.fixture(scope="session")
def tiny() -> RunConfig:
    """Milliseconds a generation, with everything that a run writes."""
    smoke = preset("smoke")
    return smoke.replace(
        generations=6,
        checkpoint_every=2,
        predators=smoke.predators.replace(n_hidden=2),
        prey=smoke.prey.replace(n_hidden=2),
        esp=smoke.esp.replace(subpopulation_size=8, n_trials=16, n_episodes=1),
        champion=smoke.champion.replace(n_candidates=2, n_held_out=8),
    )


@pytest.fixture(scope="session")
def start() -> Callable[..., Trainer]:
    """``start(path, config, threads=2)``: a new run."""

    def begin(path: Path, config: RunConfig, threads: int = 2) -> Trainer:
        return Trainer.start(RunDirectory(path), config, lambda config: FusedEvaluator(config.env, threads))

    return begin


@pytest.fixture(scope="session")
def resume() -> Callable[..., Trainer]:
    """``resume(path, generations=None)``: the run of a directory."""

    def go_on(path: Path, generations: int | None = None) -> Trainer:
        return Trainer.resume(RunDirectory(path), _evaluator, generations)

    return go_on


@pytest.fixture
def uninterrupted(
    tmp_path: Path, start: Callable[..., Trainer], snapshot: Callable[[Path], Snapshot]
) -> Callable[[RunConfig], Snapshot]:
    """``uninterrupted(config)``: what a run leaves that nothing stopped."""

    def run(config: RunConfig) -> Snapshot:
        list(start(tmp_path / "uninterrupted", config).generations())
        return snapshot(tmp_path / "uninterrupted")

    return run
