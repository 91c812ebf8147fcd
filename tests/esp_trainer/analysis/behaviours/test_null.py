"""Made-up episodes: true motions, and nobody reacts to anybody."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from esp_trainer.analysis.behaviours.null import repaired
from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.behaviours.registry import BEHAVIOURS


@pytest.fixture(scope="module")
def hunts(wander: Callable[..., np.ndarray]) -> Paths:
    """Sixty episodes of two prey; in every third the first is caught at some row, in every sixth both are."""
    trace, generator = wander(60, 2, seed=4), np.random.default_rng(5)
    times = np.full((60, 2), 151)
    times[::3, 0] = generator.integers(5, 150, 20)
    times[::6, 1] = generator.integers(5, 150, 10)
    for episode in range(60):
        for prey in range(2):
            trace[episode, times[episode, prey] :, 3 + prey] = trace[episode, min(times[episode, prey], 150), 3 + prey]
        trace[episode, times[episode].max() + 1 :] = -1
    paths = Paths.of_trace(trace, 3, 100)
    assert np.array_equal(paths.capture_times, times)
    return paths


def sources(null: Paths, paths: Paths) -> np.ndarray:
    """From which episode each prey came, int ``(n_episodes, n_prey)``."""
    same = (null.prey[:, None] == paths.prey[None]).all(axis=(2, 4))
    assert (same.sum(axis=1) == 1).all()
    return np.asarray(same.argmax(axis=1))


def test_predators_stay_and_each_prey_comes_from_another_episode(hunts: Paths):
    null = repaired(hunts, np.random.default_rng(0))
    assert np.array_equal(null.predators, hunts.predators)
    first, second = sources(null, hunts).T
    assert sorted(first) == sorted(second) == list(range(60))
    own = np.arange(60)
    assert (first != own).all()
    assert (second != own).all()
    assert (first != second).all()


def test_partners_have_the_same_prey_caught(hunts: Paths):
    null = repaired(hunts, np.random.default_rng(0))
    assert (hunts.captured[sources(null, hunts)] == hunts.captured[:, None]).all()
    assert np.array_equal(null.captured, hunts.captured)


def test_prey_live_as_long_as_in_their_own_episode(hunts: Paths):
    null = repaired(hunts, np.random.default_rng(0))
    assert np.array_equal(null.capture_times, hunts.capture_times[sources(null, hunts), np.arange(2)])


def test_an_episode_ends_with_its_predators_or_its_last_prey(hunts: Paths):
    null = repaired(hunts, np.random.default_rng(0))
    both = hunts.captured.all(axis=1)
    assert (null.lengths[~both] == 150).all()
    assert np.array_equal(null.lengths, np.minimum(hunts.lengths, null.capture_times.max(axis=1)))
    assert (null.lengths[both] < hunts.lengths[both]).any()


def test_episodes_without_enough_partners_are_left_out(hunts: Paths):
    few = Paths(*(part[:14] for part in (hunts.predators, hunts.prey, hunts.lengths, hunts.capture_times)), 100)
    assert (few.captured.sum(axis=1) == [2, 0, 0, 1, 0, 0] * 2 + [2, 0]).all()
    null = repaired(few, np.random.default_rng(0))
    # Three with both caught can be parted; two with the first caught cannot.
    assert null.n_episodes == 12
    assert sorted(null.captured.sum(axis=1)) == [0] * 9 + [2] * 3


def test_one_episode_has_no_null(hunts: Paths):
    one = Paths(*(part[:1] for part in (hunts.predators, hunts.prey, hunts.lengths, hunts.capture_times)), 100)
    null = repaired(one, np.random.default_rng(0))
    assert null.n_episodes == 0
    assert all(detector(null).shape == (0,) for detector in BEHAVIOURS.values())


def test_the_same_generator_pairs_the_same(hunts: Paths):
    one, again, other = (repaired(hunts, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert np.array_equal(one.prey, again.prey)
    assert not np.array_equal(one.prey, other.prey)


@pytest.mark.parametrize("behaviour", ["attacker", "circling"])
def test_what_reacted_no_longer_does(behaviour: str):
    """Two hundred chases, each its own place and way: all are seen, and hardly any is left in the null."""
    generator = np.random.default_rng(3)
    ways = np.array([(1, 0), (-1, 0), (0, 1), (0, -1)])
    if behaviour == "circling":
        moves = np.tile(ways[[0, 2, 1, 3]], (200, 10, 1))
    else:
        moves = np.repeat(ways[generator.integers(0, 4, (200, 5))], 8, axis=1)
    prey = generator.integers(0, 100, (200, 1, 2)) + np.cumsum(moves, axis=1)
    tail = np.stack([prey[:, :-1], prey[:, :-1] + 50, prey[:, :-1] + (30, 40), prey[:, 1:]], axis=2) % 100
    paths = Paths.of_trace(tail, 3, 100)
    assert BEHAVIOURS[behaviour](paths).mean() > 0.9
    assert BEHAVIOURS[behaviour](repaired(paths, generator)).mean() < 0.1
