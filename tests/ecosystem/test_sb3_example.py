"""Stable-Baselines3: the example trains predators that catch nearly all prey of a small torus."""

from __future__ import annotations

import pytest

pytestmark = pytest.mark.ecosystem


def test_the_example_trains_predators_that_catch_prey(caught_by_example: list[float]) -> None:
    assert len(caught_by_example) == 2
    assert caught_by_example[-1] > 0.7, "the best script catches 0.34"
