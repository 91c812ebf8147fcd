"""Stable-Baselines3: the example trains predators that catch more prey than before."""

from __future__ import annotations

import pytest

pytestmark = pytest.mark.ecosystem


def test_the_example_trains_predators_that_catch_prey(caught_by_example: list[float]) -> None:
    assert len(caught_by_example) >= 3
    assert caught_by_example[-1] > caught_by_example[0] + 0.2
