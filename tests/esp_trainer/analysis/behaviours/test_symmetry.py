"""What is seen, and in which rows, does not depend on where the seam is, which way is north, or who is called what."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.behaviours.registry import BEHAVIOURS
from esp_trainer.analysis.behaviours.specialisation import main_roles
from esp_trainer.analysis.behaviours.thresholds import Thresholds

SIZE = 31
"""Odd, as the two ways half-way round an even torus are as long, and which one is taken must depend on the axis."""

STEPS = np.array([(1, 0), (-1, 0), (0, 1), (0, -1), (0, 0)])

Found: TypeAlias = dict[str, np.ndarray]


def hunts(n_episodes: int, seed: int = 0, n_steps: int = 80) -> np.ndarray:
    """Two predators that go for the first prey and one for the second, each with one step in five at random, after prey
    that run and turn now and then: on a small torus, so that much happens.
    """
    generator = np.random.default_rng(seed)
    cells = generator.integers(0, SIZE, (n_episodes, 5, 2))
    runs, free = generator.integers(0, 4, (n_episodes, 2)), np.ones((n_episodes, 2), bool)
    rows = [cells]
    for _ in range(n_steps):
        way = (cells[:, [3, 3, 4]] - cells[:, :3] + SIZE // 2) % SIZE - SIZE // 2
        east_west = np.abs(way[..., :1]) >= np.abs(way[..., 1:])
        greedy = np.sign(np.where(np.concatenate([east_west, ~east_west], axis=2), way, 0))
        erring = generator.random((n_episodes, 3, 1)) < 0.2
        predators = np.where(erring, STEPS[generator.integers(0, 5, (n_episodes, 3))], greedy)
        runs = np.where(generator.random((n_episodes, 2)) < 0.15, generator.integers(0, 4, (n_episodes, 2)), runs)
        cells = (cells + np.concatenate([predators, STEPS[runs] * free[..., None]], axis=1)) % SIZE
        free &= ~(cells[:, :3, None] == cells[:, None, 3:]).all(axis=3).any(axis=1)
        rows.append(cells)
    return np.stack(rows, axis=1)


def seen(trace: np.ndarray) -> Found:
    paths = Paths.of_trace(trace, 3, SIZE)
    return {name: detector.rule(paths, Thresholds()) for name, detector in BEHAVIOURS.items()}


@pytest.fixture(scope="module")
def trace() -> np.ndarray:
    return hunts(60)


@pytest.fixture(scope="module")
def found(trace: np.ndarray) -> Found:
    return seen(trace)


def agree(one: Found, other: Found) -> bool:
    return all(np.array_equal(one[name], other[name], equal_nan=one[name].dtype == float) for name in BEHAVIOURS)


def test_much_happens_in_these_hunts():
    """Else what follows would say little; who baits or sidesteps on purpose is in the scripted episodes."""
    shares = {name: np.nanmean(values.any(axis=1)) for name, values in seen(hunts(300)).items() if values.ndim == 2}
    assert {name for name, share in shares.items() if share > 0} >= BEHAVIOURS.keys() - {
        "baiting", "sidestepping", "circling", "simultaneous capture", "idling", "parity idle",
    }  # fmt: skip


@given(st.integers(0, SIZE - 1), st.integers(0, SIZE - 1))
def test_the_seam_may_be_anywhere(trace: np.ndarray, found: Found, east: int, north: int):
    assert agree(seen((trace + np.array([east, north])) % SIZE), found)


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("quarters", range(4))
def test_north_may_be_any_way(quarters: int, mirrored: bool, trace: np.ndarray, found: Found):
    x, y = trace[..., 0], trace[..., 1]
    for _ in range(quarters):
        x, y = -y, x
    assert agree(seen(np.stack([-x if mirrored else x, y], axis=-1) % SIZE), found)


@pytest.mark.parametrize("order", [(1, 0, 2, 3, 4), (2, 0, 1, 3, 4), (0, 1, 2, 4, 3), (2, 1, 0, 4, 3)])
def test_agents_may_change_names(order: tuple[int, ...], trace: np.ndarray, found: Found):
    assert agree(seen(trace[:, :, order]), found)


@pytest.mark.parametrize("place", range(3))
@pytest.mark.parametrize("name", ["herding", "scattering", "simultaneous capture"])
def test_a_third_prey_that_is_elsewhere_changes_nothing(name: str, place: int, positives: dict[str, Any]):
    """Whichever of three it is, the other two are a pair."""
    (trace,) = positives[name].trace()
    elsewhere = np.stack([[50 + row % 2, 80] for row in range(len(trace))])[:, None]
    elsewhere[(trace < 0).all(axis=(1, 2))] = -1
    three = np.concatenate([trace[:, : 3 + place], elsewhere, trace[:, 3 + place :]], axis=1)
    at = Paths.of_trace(trace[None], 3, 100).capture_times if name == "simultaneous capture" else np.zeros((1, 2), int)
    paths = Paths.of_trace(three[None], 3, 100, np.insert(at, place, 0, axis=1))
    assert BEHAVIOURS[name](paths).tolist() == [1.0]


def test_roles_go_with_those_who_have_them(trace: np.ndarray):
    """Renamed predators take their roles along, as specialisation asks who has which."""
    own, renamed = (
        main_roles(Paths.of_trace(trace[:, :, order], 3, SIZE), Thresholds()) for order in (range(5), (2, 0, 1, 4, 3))
    )
    assert len(np.unique(own)) > 1
    assert np.array_equal(own[:, [2, 0, 1]], renamed)


def test_episodes_do_not_see_each_other(trace: np.ndarray, found: Found):
    backwards = seen(trace[::-1])
    assert agree({name: values[::-1] for name, values in backwards.items()}, found)


def test_rows_after_the_end_do_not_count(trace: np.ndarray, found: Found):
    """Episodes of which all prey are caught, cut there; with forty rows of -1 more the same is seen."""
    ended = trace.copy()
    times = Paths.of_trace(trace, 3, SIZE).capture_times
    rows = np.arange(trace.shape[1])
    caught = times.max(axis=1) < trace.shape[1]
    ended[(rows > times.max(axis=1)[:, None]) & caught[:, None]] = -1
    ended = ended[caught]
    assert len(ended) > 3
    longer = np.concatenate([ended, np.full((len(ended), 40, 5, 2), -1)], axis=1)
    short, long = seen(ended), seen(longer)
    for name, values in short.items():
        cut = long[name][:, : len(rows)] if values.ndim == 2 else long[name]
        assert np.array_equal(cut, values, equal_nan=values.dtype == float), name
        assert values.ndim == 1 or not long[name][:, len(rows) :].any()
