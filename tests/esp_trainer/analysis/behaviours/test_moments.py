"""Detectors that mark rows mark those at which a person would point."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.behaviours.registry import BEHAVIOURS
from esp_trainer.analysis.behaviours.thresholds import Thresholds

# The first and the last row that may be marked, and one that must be.
MOMENTS = {
    "attacker": (0, 24, 24),  # from the start on its tail
    "blocker": (0, 16, 16),  # the prey runs at it from the start to row 16
    "role switch": (14, 17, 15),  # the prey turns off in row 16, and the blocker goes after it
    "opposing attack": (5, 16, 14),  # both are near from row 10 or so on
    "encirclement": (8, 14, 14),  # they close in to the end
    "circling": (9, 17, 17),  # two rounds of four steps, and the step before the first turn
    "baiting": (8, 10, 10),  # it waits to row 10 and leaves
    "sidestepping": (14, 15, 15),  # step 16 goes aside, when the blocker is at most six ahead
    "reversal": (9, 10, 10),  # step 11 goes aside, and those after it back
    "herding": (12, 20, 20),  # together since row 12; twenty steps in all
    "scattering": (8, 10, 10),  # they part after row 10
}


def rows(name: str, paths: Any) -> list[int]:
    found = BEHAVIOURS[name].rule(paths, Thresholds())
    assert found.shape == (1, paths.n_rows)
    return np.flatnonzero(found[0]).tolist()


@pytest.mark.parametrize("name", MOMENTS)
def test_a_behaviour_is_seen_when_it_happens(name: str, positives: dict[str, Any]):
    earliest, latest, moment = MOMENTS[name]
    found = rows(name, positives[name].paths())
    assert moment in found
    assert earliest <= found[0] <= found[-1] <= latest


@pytest.mark.parametrize("name", MOMENTS)
def test_it_is_seen_as_much_later_as_it_happens_later(name: str, positives: dict[str, Any], scene: Any):
    """Thirty steps of nothing first: the prey dithers, and every predator idles where it will start."""
    before = positives[name]
    predators = [(start, "." * 30 + moves) for start, moves in before.predators]
    prey = [(start, "NS" * 15 + moves) for start, moves in before.prey]
    found = rows(name, scene(predators, prey).paths())
    earliest, latest, moment = MOMENTS[name]
    assert 30 + moment in found
    # Windows now may begin in the rows before: a blocker has kept to its place for longer.
    assert earliest + 25 <= found[0] <= found[-1] <= latest + 30


@pytest.mark.parametrize(("steps_free", "dodged"), [(9, 0.0), (10, 1.0)])
def test_a_dodge_is_judged_ten_steps_later(steps_free: int, dodged: float, positives: dict[str, Any]):
    """The episode of a prey that waits to row 10 and leaves, cut so many steps after that."""
    trace = positives["baiting"].trace()[:, : 10 + steps_free + 1]
    found = BEHAVIOURS["baiting"].rule(Paths.of_trace(trace, 3, 100), Thresholds())
    assert float(found[0, 10]) == dodged


def test_a_simultaneous_capture_is_seen_when_the_later_prey_is_caught(positives: dict[str, Any]):
    paths = positives["simultaneous capture"].paths()
    assert paths.capture_times.tolist() == [[5, 8]]
    assert rows("simultaneous capture", paths) == [8]


def test_every_behaviour_with_rows_has_its_moment():
    assert MOMENTS.keys() == BEHAVIOURS.keys() - {"simultaneous capture", "idling", "parity idle"}
