"""Runs whose sides are bred by other algorithms than ESP: resumed, they end in the same bytes."""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice
from pathlib import Path
from typing import Any

import pytest

from esp_trainer.algorithms import ALGORITHMS
from esp_trainer.coevolution.sides import new_sides
from esp_trainer.config import RunConfig
from esp_trainer.run.trainer import Trainer


@pytest.mark.parametrize("name", ALGORITHMS)
def test_a_run_that_was_stopped_ends_in_the_bytes_of_one_that_was_not(
    name: str,
    tiny: RunConfig,
    tmp_path: Path,
    start: Callable[..., Trainer],
    resume: Callable[..., Trainer],
    snapshot: Any,
    uninterrupted: Any,
) -> None:
    if name == "cma_es":
        pytest.importorskip("cma")
    pool = {"esp.n_episodes": 2, "esp.past_share": 0.5, "esp.exploiters_every": 3, "esp.exploiter_generations": 1}
    config = tiny.with_fields({"predators.algorithm": name, "esp.burst_after": 2, **pool})
    whole = uninterrupted(config)
    run = tmp_path / "stopped"
    list(islice(start(run, config, threads=1).generations(), 3))
    list(resume(run).generations())
    assert snapshot(run) == whole


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"prey.algorithm": "sep"}, "prey: algorithm must be one of .*; did you mean esp\\?"),
        (
            {"prey.algorithm": "ga", "prey.algorithm_options": {"size": 3}},
            "prey: unknown option size; there are n_teams",
        ),
        ({"predators.algorithm_options": {"size": 3}}, "predators: algorithm esp cannot start with these options: .*"),
    ],
)
def test_an_algorithm_that_cannot_start_is_told_with_its_side(
    fields: dict[str, Any], message: str, tiny: RunConfig
) -> None:
    with pytest.raises(ValueError, match=f"^{message}$"):
        new_sides(tiny.with_fields(fields))
