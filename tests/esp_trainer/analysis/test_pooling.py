"""Which runs are measured together, and how far."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from esp_trainer.analysis.history import CURVES, History
from esp_trainer.analysis.pooling import check_same_config, cut_to_shortest, note_on_champions
from esp_trainer.config import RunConfig
from esp_trainer.presets import preset


def history(n: int, kept: list[int]) -> History:
    """Whose champions are known by their generation."""
    champions = {"prey": np.array(kept, np.float32).reshape(-1, 1, 1, 1, 1)}
    return History(RunConfig(), champions, dict.fromkeys(CURVES, np.arange(n, dtype=float)), np.array(kept))  # type: ignore[arg-type]


def test_runs_are_cut_to_the_shortest_and_to_the_champions_that_all_keep() -> None:
    short, long = cut_to_shortest([history(6, [0, 2, 4, 5]), history(9, [0, 4, 8])])
    for run in (short, long):
        assert len(run) == 6
        assert run.kept.tolist() == [0, 4]
        assert run.champions["prey"].ravel().tolist() == [0, 4]
        assert run.curves["caught"].tolist() == [0, 1, 2, 3, 4, 5]


def test_what_not_all_runs_keep_is_said() -> None:
    histories = [history(6, [0, 2, 4, 5]), history(9, [0, 4, 8])]
    assert note_on_champions(histories) == "Champions of only 2 generations are kept by all runs."
    assert note_on_champions([history(6, [0, 4]), history(9, [0, 4, 8])]) is None
    assert note_on_champions([history(6, [0, 2, 4, 5])]) is None


def test_a_single_run_is_not_cut() -> None:
    (run,) = cut_to_shortest([history(6, [0, 2, 4, 5])])
    assert run.kept.tolist() == [0, 2, 4, 5]
    assert len(run) == 6


def test_runs_without_a_champion_of_the_same_generation_are_refused() -> None:
    with pytest.raises(ValueError, match=r"^runs must have champions of the same generations, got none that all of"):
        cut_to_shortest([history(3, [0, 2]), history(3, [1])])


def test_names_lengths_and_savings_may_differ() -> None:
    first = preset("smoke")
    others = [first.replace(seed=1, preset="mine"), first.replace(seed=2, generations=3, checkpoint_every=1)]
    check_same_config([(Path(f"{config.seed}"), config) for config in (first, *others)])
