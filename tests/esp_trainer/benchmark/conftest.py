"""A result to write down."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from esp_trainer.benchmark.gauntlet import OpponentResult, Standing
from esp_trainer.benchmark.report import BenchmarkResult
from esp_trainer.statistics import Rate, wilson_of


@pytest.fixture(scope="session")
def result() -> Callable[..., BenchmarkResult]:
    """``result(held_out=0.4, **fields)``: of predators that met four opponents."""

    def make(held_out: float = 0.4, **fields: Any) -> BenchmarkResult:
        rows = [
            OpponentResult("held-out/x-3v2/prey/seed-1-late", "held out", wilson_of(held_out, 64), 12.5, 71.25),
            OpponentResult("held-out/paper-3v2/prey/seed-1-late", "older held out", wilson_of(0.25, 64), 12.5, 80.0),
            OpponentResult("x-3v2/prey/seed-2-late", "zoo", wilson_of(0.5, 64), 10.0, None),
            OpponentResult("random", "scripts", wilson_of(1.0, 64), 25.0, 30.0),
        ]
        standing = Standing(
            {
                "held out": (held_out, held_out),
                "older held out": (0.25, 0.25),
                "zoo": (0.5, 0.5),
                "scripts": (1.0, 1.0),
            },
            Rate(31.2, -4.6, 66.0),
            3,
            17,
            0.0125,
            0.25,
        )
        known: dict[str, Any] = {
            "name": "hunters",
            "spec": "my_policies:hunters",
            "digest": "0123456789abcdef0123",
            "drawn": False,
            "role": "predators",
            "task": "3v2",
            "n_episodes": 64,
            "seed": 5,
            "zoo": "fedcba9876543210",
            "rows": rows,
            "standing": standing,
        }
        return BenchmarkResult(**{**known, **fields})

    return make
