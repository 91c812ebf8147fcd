"""Herding, scattering and captures together, and what is nearly that."""

from __future__ import annotations

from typing import Any

import pytest

from esp_trainer.analysis.behaviours.registry import BEHAVIOURS

DITHER = "NS" * 4
BEHIND = [((26, 50), "E" * 12), ((66, 52), "W" * 12)]
INWARDS = [((30, 50), "E" * 12 + DITHER), ((62, 52), "W" * 12 + DITHER)]
NORTH_AND_SOUTH = [((51, 65), "S" * 10), ((51, 35), "N" * 10)]

CASES = {
    "herding": [
        ("one is driven, the other dithers", BEHIND[:1], INWARDS, 0.0),
        ("driven from between them", [((34, 50), "E" * 12), ((58, 52), "W" * 12)], INWARDS, 0.0),
        ("they come no nearer", [((40, 50), ""), ((60, 50), "")], [((45, 50), "NS" * 10), ((55, 50), "NS" * 10)], 0.0),
        ("still far apart", [((16, 50), "E" * 12), ((76, 52), "W" * 12)],
         [((20, 50), "E" * 12 + DITHER), ((72, 52), "W" * 12 + DITHER)], 0.0),
    ],
    "scattering": [
        ("at a right angle", NORTH_AND_SOUTH, [((50, 50), "EW" * 5 + "W" * 10), ((52, 50), "EW" * 5 + "N" * 10)], 1.0),
        ("the same way", NORTH_AND_SOUTH, [((50, 50), "EW" * 5 + "W" * 10), ((52, 50), "EW" * 5 + "W" * 10)], 0.0),
        ("one predator", NORTH_AND_SOUTH[:1], [((50, 50), "EW" * 5 + "W" * 10), ((52, 50), "EW" * 5 + "E" * 10)], 0.0),
        ("ways less than 90 degrees apart", NORTH_AND_SOUTH,
         [((50, 50), "EW" * 5 + "N" * 10), ((52, 50), "EW" * 5 + "E" * 6 + "N" * 4)], 0.0),
        ("they just cross", [((48, 64), "S" * 10), ((38, 48), "E" * 10)],
         [((50, 40), "N" * 20), ((60, 50), "W" * 20)], 0.0),
        ("far from each other", NORTH_AND_SOUTH,
         [((50, 50), "EW" * 5 + "W" * 10), ((62, 50), "EW" * 5 + "E" * 10)], 0.0),
    ],
}  # fmt: skip


@pytest.mark.parametrize(
    ("name", "case"), [pytest.param(name, case, id=f"{name}: {case[0]}") for name in CASES for case in CASES[name]]
)
def test_what_is_it_and_what_is_not(name: str, case: Any, scene: Any):
    _, predators, prey, seen = case
    assert BEHAVIOURS[name](scene(predators, prey).paths()).tolist() == [seen]


@pytest.mark.parametrize(("later", "together"), [(0, 1.0), (5, 1.0), (6, 0.0)])
def test_captures_within_five_steps_are_simultaneous(later: int, together: float, scene: Any):
    prey = [((55, 50), "W" * 5), ((14 + later, 20), "W" * (5 + later))]
    paths = scene([((45, 50), "E" * 5), ((9, 20), "")], prey, n_rows=40).paths()
    assert paths.capture_times.tolist() == [[5, 5 + later]]
    assert BEHAVIOURS["simultaneous capture"](paths).tolist() == [together]


def test_one_capture_is_not_simultaneous_with_none(scene: Any):
    paths = scene([((45, 50), "E" * 5)], [((55, 50), "W" * 5), ((14, 20), "N" * 6)]).paths()
    assert paths.captured.tolist() == [[True, False]]
    assert BEHAVIOURS["simultaneous capture"](paths).tolist() == [0.0]
