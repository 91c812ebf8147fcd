"""Every detector fires on its scripted episode, wherever and however it is turned, and hardly ever by chance."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.behaviours.registry import BEHAVIOURS

SHARES = {"idling", "parity idle"}
EVENTS = sorted(BEHAVIOURS.keys() - SHARES)
WITH_TWO_PREY = {"herding", "simultaneous capture", "scattering"}


def seen(name: str, trace: np.ndarray) -> float:
    (value,) = BEHAVIOURS[name](Paths.of_trace(trace, 3, 100))
    return float(value)


@pytest.mark.parametrize("name", EVENTS)
def test_it_fires_on_what_is_plainly_it(name: str, positives: dict[str, Any]):
    assert seen(name, positives[name].trace()) == 1.0


@pytest.mark.parametrize("name", EVENTS)
@given(
    shift=st.tuples(st.integers(0, 99), st.integers(0, 99)),
    quarters=st.integers(0, 3),
    mirrored=st.booleans(),
    order=st.permutations(range(3)),
)
def test_it_fires_over_the_seam_turned_mirrored_and_with_predators_renamed(
    name: str,
    shift: tuple[int, int],
    quarters: int,
    mirrored: bool,
    order: list[int],
    positives: dict[str, Any],
):
    trace = positives[name].trace()
    trace = np.concatenate([trace[:, :, order], trace[:, :, 3:]], axis=2)
    x, y = trace[..., 0], trace[..., 1]
    for _ in range(quarters):
        x, y = -y, x
    moved = np.stack([-x if mirrored else x, y], axis=-1) + shift
    assert seen(name, np.where(trace < 0, -1, moved % 100)) == 1.0


@pytest.mark.parametrize("name", sorted(set(EVENTS) - {"simultaneous capture"}))
@given(shift=st.tuples(st.integers(40, 60), st.integers(40, 60)))
def test_it_does_not_fire_where_the_predators_are_elsewhere(
    name: str, shift: tuple[int, int], positives: dict[str, Any]
):
    actors = [((x + shift[0], y + shift[1]), moves) for (x, y), moves in positives[name].predators]
    assert seen(name, positives[name]._replace(predators=actors).trace()) == 0.0


@pytest.mark.parametrize("straight", [False, True], ids=["random walks", "straight runs"])
@pytest.mark.parametrize("name", EVENTS)
def test_those_who_do_not_look_hardly_ever_do_it(name: str, straight: bool, wander: Callable[..., np.ndarray]):
    trace = wander(300, 2 if name in WITH_TWO_PREY else 1, straight)
    assert BEHAVIOURS[name](Paths.of_trace(trace, 3, 100)).mean() < 0.02


@pytest.mark.parametrize("name", sorted(WITH_TWO_PREY))
def test_one_prey_cannot_do_what_takes_two(name: str, wander: Callable[..., np.ndarray]):
    assert np.isnan(BEHAVIOURS[name](Paths.of_trace(wander(4, 1), 3, 100))).all()


def test_what_takes_several_predators_cannot_be_asked_of_one(wander: Callable[..., np.ndarray]):
    one = Paths.of_trace(wander(4, 1)[:, :, 2:], 1, 100)
    unasked = {name for name, detector in BEHAVIOURS.items() if np.isnan(detector(one)).all()}
    several = {"opposing attack", "encirclement", "baiting", "reversal"}
    assert unasked == WITH_TWO_PREY | several | {"parity idle"}


def test_each_line_of_the_table_is_told():
    assert all(detector.meaning and detector.who in ("predators", "prey") for detector in BEHAVIOURS.values())
    assert all((detector.min_prey == 2) == (name in WITH_TWO_PREY) for name, detector in BEHAVIOURS.items())
