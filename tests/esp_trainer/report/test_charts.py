"""The charts' figures, from numbers that are made up."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from esp_trainer.analysis.exploiters import Exploiters
from esp_trainer.analysis.genealogy import Genealogy, Origins
from esp_trainer.analysis.history import CURVES, History
from esp_trainer.config import RunConfig
from esp_trainer.report.charts import charts
from esp_trainer.report.measure import MeasuredRuns
from esp_trainer.report.source import RunSource
from esp_trainer.report.win_matrix import win_matrix
from esp_trainer.run.genealogy import Layout
from esp_trainer.types import Role

N = 30


def source(level: float) -> RunSource:
    curves = {name: np.full((N, 2) if name.startswith("trials") else N, level) for name in CURVES}
    champions = {"predators": np.full((N, 3, 2, 10, 7), level, np.float32)}
    history = History(RunConfig(), champions, curves)  # type: ignore[arg-type]
    spreads = {
        "predators": np.stack([np.full(N, level), np.full(N, 2 * level), np.full(N, 0.1), np.full(N, 0.5)], axis=1)
    }
    seconds = {"trials": np.full(N, level / 10)}
    return RunSource("run", Path("run"), RunConfig(), N, history, curves, spreads, seconds, ())  # type: ignore[arg-type]


def figures(*runs: MeasuredRuns) -> dict[str, Any]:
    return {figure["id"]: figure for figure in charts(runs)}


def test_there_is_a_chart_of_all_that_is_known_and_of_nothing_else() -> None:
    assert set(figures(MeasuredRuns(source(0.5)))) == {"success", "signal", "diversity", "weights", "timings"}
    without = replace(source(0.5), spreads={}, seconds={}, history=None)
    assert set(figures(MeasuredRuns(without))) == {"success"}
    assert win_matrix([MeasuredRuns(without)]) is None


def test_what_an_older_log_does_not_tell_is_not_drawn() -> None:
    older = source(0.5)
    older.spreads["predators"][:, 2:] = np.nan
    assert set(figures(MeasuredRuns(older))) == {"success", "diversity", "weights", "timings"}


def test_a_run_is_a_line_two_are_their_mean_and_more_are_that_in_a_band() -> None:
    (one,) = figures(MeasuredRuns(source(0.2)))["diversity"]["data"]
    assert one["y"] == [0.2] * N
    (two,) = figures(MeasuredRuns(source(0.2)), MeasuredRuns(source(0.4)))["diversity"]["data"]
    assert two["y"] == pytest.approx([0.3] * N)
    three = figures(*(MeasuredRuns(source(level)) for level in (0.2, 0.3, 0.4)))
    band, mean = three["diversity"]["data"]
    assert mean["y"] == pytest.approx([0.3] * N)
    half = 4.3027 * 0.1 / np.sqrt(3)  # Student's of two degrees of freedom, times the standard error
    assert band["y"][:N] == pytest.approx([0.3 + half] * N, abs=1e-3)
    assert band["y"][N:] == pytest.approx([0.3 - half] * N, abs=1e-3)
    assert band["x"] == [*range(N), *reversed(range(N))]


def test_exploiters_are_drawn_at_the_generations_whose_champions_they_met() -> None:
    reached: dict[Role, Any] = {"predators": np.array([0.9, 0.6, 0.3, 0.3]), "prey": np.array([0.8, 0.8, 0.8, 0.8])}
    exploiters = Exploiters(np.array([4, 9, 14, 19]), reached)
    figure = figures(MeasuredRuns(replace(source(0.5), exploiters=exploiters)))["exploiters"]
    hunting, fleeing = figure["data"]
    assert hunting["x"] == fleeing["x"] == [4, 9, 14, 19]
    assert hunting["y"] == pytest.approx([0.75, 0.6, 0.4, 0.3])  # means over three
    assert (hunting["name"], fleeing["name"]) == ("exploiting predators: prey caught", "exploiting prey: not caught")
    assert hunting["line"]["dash"] != fleeing["line"]["dash"]


def with_genealogy(founders: float, from_past: float, bred: int) -> MeasuredRuns:
    """Predators whose founders and genes end at these values, after generations that were bred one in so many."""
    ramp = np.arange(N) / (N - 1)
    curves = 100 + (founders - 100) * ramp, from_past * ramp, np.arange(N) * (1 - 1 / bred)
    nobody = Origins(*np.zeros((3, N, 1, 6), int))
    genealogy = Genealogy(Layout((6,), size=100, n_elite=25, hof_mates=5), *curves, nobody)
    return MeasuredRuns(replace(source(0.5), genealogies={"predators": genealogy}))


def test_a_genealogy_is_drawn_and_put_in_words() -> None:
    two = figures(with_genealogy(3.0, 0.8, bred=29), with_genealogy(5.0, 0.6, bred=29))
    (line,) = two["founders"]["data"]
    assert (line["y"][0], line["y"][-1]) == (100.0, 4.0)
    assert two["founders"]["layout"]["yaxis"]["range"] == [0, 2]  # from 1 to 100
    assert two["founders"]["caption"].endswith(
        "In the end it is 4.0 for the predators; few have taken over, and what is new comes from mutation."
    )
    back, skipped = two["past"]["data"]
    assert (back["y"][0], back["y"][-1]) == (0.0, 0.7)
    assert skipped["y"][1:] == pytest.approx([28 / 29] * (N - 1), abs=1e-4)
    assert back["line"]["dash"] != skipped["line"]["dash"]
    assert two["past"]["caption"].endswith("In 29 generations a gene was bred 1 time for the predators.")


def test_where_no_past_champion_mated_only_the_founders_are_drawn() -> None:
    found = figures(with_genealogy(60.0, 0.0, bred=1))
    assert "past" not in found
    assert found["founders"]["caption"].endswith("In the end it is 60.0 for the predators.")


def test_times_are_milliseconds_and_weights_their_mean_size() -> None:
    found = figures(MeasuredRuns(source(0.5)))
    assert found["timings"]["data"][0]["y"] == pytest.approx([50.0] * N)
    champions, everybody = found["weights"]["data"]
    assert champions["y"] == pytest.approx([0.5] * N)
    assert everybody["y"] == pytest.approx([1.0] * N)
    assert champions["legendgroup"] != everybody["legendgroup"]


def test_what_is_not_known_is_left_blank() -> None:
    gappy = source(0.5)
    gappy.spreads["predators"][3] = np.nan
    (line,) = figures(MeasuredRuns(gappy))["diversity"]["data"]
    assert line["y"][2:5] == [0.5, None, 0.5]


def test_a_reader_can_tell_curves_apart_without_colours() -> None:
    lines = figures(MeasuredRuns(source(0.5)))["success"]["data"]
    assert len({line["line"]["dash"] for line in lines}) == len(lines) == 3
