"""Rates beside the rates of chance."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from esp_trainer.analysis.behaviours.counts import count_behaviours
from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.behaviours.registry import BEHAVIOURS


def mixed(scenes: dict[str, Any], *names: str) -> Paths:
    """Episodes of one prey, each at a place of its own, cut to the same length."""
    traces = [scenes[name].trace() for name in names]
    length = min(trace.shape[1] for trace in traces)
    places = np.random.default_rng(0).integers(0, 100, (len(names), 1, 1, 2))
    return Paths.of_trace((np.concatenate([trace[:, :length] for trace in traces]) + places) % 100, 3, 100)


def test_a_rate_is_the_share_of_episodes(positives: dict[str, Any]):
    paths = mixed(positives, *["circling", "baiting", "blocker", "circling"] * 5)
    rates = count_behaviours(paths, np.random.default_rng(0))
    assert rates["circling"].rate == 0.5
    assert rates["circling"].n == 20
    assert rates["circling"].excess == rates["circling"].rate - rates["circling"].null
    assert rates["circling"].null < 0.2


def test_every_behaviour_is_counted_in_order(wander: Callable[..., np.ndarray]):
    rates = count_behaviours(Paths.of_trace(wander(30, 2), 3, 100), np.random.default_rng(0))
    assert list(rates) == [*BEHAVIOURS, "specialisation"]


def test_walkers_at_random_exceed_nothing(wander: Callable[..., np.ndarray]):
    rates = count_behaviours(Paths.of_trace(wander(300, 2), 3, 100), np.random.default_rng(0))
    assert all(abs(rate.excess) < 0.02 for rate in rates.values() if not np.isnan(rate.null))
    assert rates["idling"].excess == rates["idling"].rate, "nobody idles at another by chance"
    assert rates["idling"].rate == pytest.approx(0.2, abs=0.01)


def test_what_cannot_be_asked_is_nan(wander: Callable[..., np.ndarray]):
    rates = count_behaviours(Paths.of_trace(wander(30, 1), 3, 100), np.random.default_rng(0))
    assert rates["herding"].n == 0
    assert all(np.isnan([rates["herding"].rate, rates["herding"].null, rates["herding"].excess]))
    assert np.isnan(rates["idling"].null)
    assert np.isnan(rates["specialisation"].rate)


def test_the_same_generator_counts_the_same(positives: dict[str, Any]):
    paths = mixed(positives, *["attacker", "blocker", "circling", "role switch"] * 6)
    one, again = (count_behaviours(paths, np.random.default_rng(7), pairings=3) for _ in range(2))
    assert repr(one) == repr(again)


def test_more_pairings_make_the_chance_steadier(positives: dict[str, Any]):
    """All at one place, so that now and then the prey of another chase fits."""
    traces = [positives[name].trace()[:, :17] for name in ("attacker", "blocker", "circling", "role switch") * 6]
    paths = Paths.of_trace(np.concatenate(traces), 3, 100)

    def spread(pairings: int) -> float:
        generators = (np.random.default_rng(seed) for seed in range(8))
        return float(np.std([count_behaviours(paths, it, pairings=pairings)["attacker"].null for it in generators]))

    assert spread(12) < 0.6 * spread(1)


def test_roles_that_stay_with_a_predator_are_specialised(scene: Any):
    places = np.random.default_rng(0).integers(0, 100, (20, 1, 1, 2))
    trace = scene([((46, 50), "E" * 16), ((70, 50), "")], [((50, 50), "E" * 16)]).trace()
    rates = count_behaviours(Paths.of_trace((trace + places) % 100, 3, 100), np.random.default_rng(0))
    assert rates["specialisation"].rate == 1.0
    assert rates["specialisation"].null < 0.3
    assert rates["specialisation"].n == 40
