"""pyribs: its CMA-ES breeds the predators through ``AskTell``, and goes on from a checkpoint to the same bytes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ribs.archives import GridArchive
from ribs.emitters import EvolutionStrategyEmitter
from ribs.schedulers import Scheduler

from esp_trainer.algorithms.ask_tell import AskTell
from esp_trainer.cli import main

pytestmark = pytest.mark.ecosystem

OPTIONS = ["--predators.algorithm", f"{__name__}:Ribs", "--esp.n_trials", "60", "--quiet"]


class Ribs(AskTell):
    """The whole of what a user writes."""

    def optimiser(self, start: np.ndarray, seed: int) -> Any:
        archive = GridArchive(solution_dim=len(start), dims=[1], ranges=[(-1.0, 1.0)], seed=seed)
        emitter = EvolutionStrategyEmitter(archive, x0=start, sigma0=1.0, ranker="obj", batch_size=20, seed=seed)
        return Losses(Scheduler(archive, [emitter]))


class Losses:
    """A scheduler of pyribs, which maximises objectives and wants measures of behaviour, told losses."""

    def __init__(self, scheduler: Scheduler) -> None:
        self.scheduler = scheduler
        self.ask = scheduler.ask

    def tell(self, solutions: np.ndarray, losses: list[float]) -> None:
        self.scheduler.tell(-np.array(losses), np.zeros((len(solutions), 1)))


def test_a_run_that_is_resumed_ends_in_the_same_bytes(tmp_path: Path) -> None:
    for name, generations in (("whole", "6"), ("resumed", "3")):
        out = str(tmp_path / name)
        assert (
            main(["train", "pond", "--prey.policy", "random", "--generations", generations, "--out", out, *OPTIONS])
            == 0
        )
    assert main(["resume", str(tmp_path / "resumed"), "--generations", "6", "--quiet"]) == 0
    whole, resumed = ((tmp_path / name / "metrics.jsonl").read_bytes() for name in ("whole", "resumed"))
    assert whole == resumed
    assert whole.count(b"\n") == 6
