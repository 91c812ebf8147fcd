"""Idle steps, and captures that they made possible, by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from esp_trainer.analysis.behaviours.registry import BEHAVIOURS


def test_idle_steps_are_counted_while_the_episode_lasts(scene: Any):
    """Of 3 x 4 steps the first predator idles on one, the second on two, the third on none."""
    walkers = [((46, 50), "E.EE"), ((20, 20), "..NN"), ((20, 60), "NNNN")]
    paths = scene(walkers, [((53, 50), "WWWW")], n_rows=20).paths()
    assert BEHAVIOURS["idling"](paths).tolist() == [3 / 12]


@pytest.mark.parametrize(
    ("moves", "start", "mended"), [("E.EE", 46, 1.0), ("EEEE", 45, 0.0), ("E..E", 47, 0.0), ("...E", 48, 1.0)]
)
def test_an_odd_number_of_idles_mends_the_parity(moves: str, start: int, mended: float, scene: Any):
    """The prey is caught at (49, 50) in row 4."""
    paths = scene([((start, 50), moves)], [((53, 50), "WWWW")], n_rows=20).paths()
    assert paths.distances[0, 4, 0, 0] == 0
    assert (paths.distances[0, 0, 0, 0] % 2 == 1) == bool(mended)
    assert BEHAVIOURS["parity idle"](paths).tolist() == [mended]


def test_idles_after_the_capture_do_not_count(scene: Any):
    paths = scene([((49, 50), "E.")], [((51, 50), "W."), ((20, 20), "NN")]).paths()
    assert BEHAVIOURS["parity idle"](paths).tolist() == [0.0]


def test_the_share_is_over_the_captures_of_an_episode(scene: Any):
    hunters = [((48, 50), ".E"), ((28, 20), "EE")]
    paths = scene(hunters, [((51, 50), "WW"), ((32, 20), "WW")], n_rows=9).paths()
    assert BEHAVIOURS["parity idle"](paths).tolist() == [0.5]


def test_without_a_known_captor_it_cannot_be_asked(scene: Any):
    """Nobody is caught; or by one who has moved on."""
    free = scene([], [((50, 50), "WW")]).paths()
    gone = scene([((48, 50), ".N.")], [((50, 50), "WW.")], n_rows=9).paths()
    assert gone.captured.all()
    assert all(np.isnan(BEHAVIOURS["parity idle"](paths)).all() for paths in (free, gone))
