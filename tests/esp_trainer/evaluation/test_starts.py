"""Where episodes start, by hand and in proportion."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from esp_trainer.evaluation.starts import CellStarts, SeedStarts, distances
from predprey_env import EnvConfig
from predprey_env.rules.torus import displacement, manhattan


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def counts_of_even(starts: CellStarts, n: int, seed: int = 0) -> list[list[int]]:
    """For each prey, how many held-out starts have 0, 1, ... predators at an even distance from it."""
    even = starts.even_predators(starts.held_out(rng(seed), n))[:, 0]
    return [np.bincount(some, minlength=starts.config.n_predators + 1).tolist() for some in even.T]


# -- distances -------------------------------------------------------------------------------------------------------


def test_distances_take_the_shorter_way_round():
    starts = np.array([[0, 0], [5, 5], [9, 2], [9, 9], [5, 0]])  # three predators, two prey
    assert distances(starts, EnvConfig(size=10)).tolist() == [[2, 5], [8, 5], [3, 6]]


def test_distances_on_an_odd_torus():
    starts = np.array([[0, 0], [4, 3]])
    assert distances(starts, EnvConfig(size=7, n_predators=1, n_prey=1)).tolist() == [[6]]


@pytest.mark.parametrize("size", [6, 7, 100, 101])
def test_distances_are_those_of_the_rules(size: int):
    """They are computed on whole arrays of starts here, and step by step there."""
    cells = rng().integers(0, size, (200, 2, 2), dtype=np.int32)
    config = EnvConfig(size=size, n_predators=1, n_prey=1)
    for start in cells:
        here, there = start
        ways = [displacement(a, b, size) for a, b in zip(here, there, strict=True)]
        assert distances(start, config) == manhattan(*ways)


def test_distances_keep_all_leading_axes():
    starts = rng().integers(0, 10, (4, 3, 5, 2))
    apart = distances(starts, EnvConfig(size=10))
    assert apart.shape == (4, 3, 3, 2)
    assert np.array_equal(apart[2, 1], distances(starts[2, 1], EnvConfig(size=10)))


@given(st.integers(3, 12), st.integers(0, 1000))
def test_distance_is_the_fewest_steps_from_cell_to_cell(size: int, seed: int):
    """Against every image of the prey on the plane."""
    start = rng(seed).integers(0, size, (2, 2))
    shifts = np.array([-size, 0, size])
    dx, dy = (np.abs(start[1, axis] - start[0, axis] + shifts).min() for axis in range(2))
    assert distances(start, EnvConfig(size=size, n_predators=1, n_prey=1)) == dx + dy


def test_even_predators_counts_predators_at_an_even_distance_from_each_prey():
    starts = np.array([[[[0, 0], [5, 5], [9, 2], [9, 9], [5, 0]]]])  # distances 2 5, 8 5, 3 6
    assert CellStarts(EnvConfig(size=10)).even_predators(starts).tolist() == [[[2, 1]]]


# -- random starts ---------------------------------------------------------------------------------------------------


def test_starts_are_cells_of_all_agents_for_each_episode_of_each_trial():
    starts = CellStarts(EnvConfig(size=9)).draw(rng(), 7, 4)
    assert starts.shape == (7, 4, 5, 2)
    assert starts.dtype == np.int32
    assert starts.min() == 0
    assert starts.max() == 8


def test_starts_are_uniform_and_differ_between_episodes():
    starts = CellStarts(EnvConfig(size=8)).draw(rng(), 1000, 4)
    for agent in range(5):
        for axis in range(2):
            counts = np.bincount(starts[:, :, agent, axis].ravel(), minlength=8)
            assert (abs(counts - 500) < 100).all()
    assert not np.array_equal(starts[:, 0], starts[:, 1])


@pytest.mark.parametrize("method", ["draw", "held_out"])
def test_no_predator_starts_on_a_prey(method: str):
    config = EnvConfig(size=4)
    starts = CellStarts(config)
    drawn = starts.draw(rng(), 500, 1) if method == "draw" else starts.held_out(rng(), 500)
    assert distances(drawn, config).min() == 1


@pytest.mark.parametrize("method", ["draw", "held_out"])
def test_predators_start_on_prey_where_that_is_allowed(method: str):
    config = EnvConfig(size=4, start_collisions="allow")
    starts = CellStarts(config)
    drawn = starts.draw(rng(), 500, 1) if method == "draw" else starts.held_out(rng(), 500)
    assert distances(drawn, config).min() == 0


def test_team_mates_may_start_in_the_same_cell():
    starts = CellStarts(EnvConfig(size=3)).draw(rng(), 500, 1)
    assert (starts[:, 0, 0] == starts[:, 0, 1]).all(axis=-1).any()


def test_an_episode_can_be_reset_to_its_start():
    start = CellStarts(EnvConfig()).draw(rng(), 1, 1)[0, 0]
    assert np.array_equal(CellStarts(EnvConfig()).reset_arguments(start)["options"]["starts"], start)


# -- held-out starts -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [100, 12, 4])
@pytest.mark.parametrize("seed", [0, 1])
def test_held_out_starts_of_three_predators_and_a_prey_are_in_proportions_1_3_3_1(size: int, seed: int):
    starts = CellStarts(EnvConfig(n_prey=1, size=size))
    assert counts_of_even(starts, 200, seed) == [[25, 75, 75, 25]]


@pytest.mark.parametrize(("n_prey", "size"), [(2, 100), (2, 6), (3, 100)])
def test_held_out_starts_are_in_proportion_for_each_prey(n_prey: int, size: int):
    starts = CellStarts(EnvConfig(n_prey=n_prey, size=size))
    assert counts_of_even(starts, 200) == [[25, 75, 75, 25]] * n_prey


@pytest.mark.parametrize(
    ("n_predators", "n", "expected"),
    [(1, 10, [5, 5]), (2, 200, [50, 100, 50]), (3, 64, [8, 24, 24, 8]), (4, 160, [10, 40, 60, 40, 10])],
)
def test_held_out_starts_of_any_number_of_predators_are_in_binomial_proportions(
    n_predators: int, n: int, expected: list[int]
):
    assert counts_of_even(CellStarts(EnvConfig(n_predators=n_predators, n_prey=1)), n) == [expected]


def test_all_patterns_of_parity_among_two_prey_are_as_frequent():
    config = EnvConfig(n_prey=2)
    starts = CellStarts(config).held_out(rng(), 160)[:, 0]
    odd = distances(starts, config) % 2
    patterns = [tuple(row.ravel()) for row in odd]
    assert {patterns.count(pattern) for pattern in set(patterns)} == {10}
    assert len(set(patterns)) == 16


def test_held_out_starts_are_one_a_trial_and_uniform():
    config = EnvConfig(size=8)
    starts = CellStarts(config).held_out(rng(), 4000)
    assert starts.shape == (4000, 1, 5, 2)
    assert starts.dtype == np.int32
    for agent in range(5):
        cells = starts[:, 0, agent, 0] * 8 + starts[:, 0, agent, 1]
        counts = np.bincount(cells, minlength=64)
        assert len(counts) == 64
        assert (abs(counts - 62.5) < 40).all()


def test_held_out_starts_on_an_odd_torus_are_plain_random_ones():
    config = EnvConfig(size=5, n_prey=1)
    starts = CellStarts(config).held_out(rng(), 4000)
    assert starts.max() == 4
    assert starts.min() == 0
    for agent in range(4):
        counts = np.bincount(starts[:, 0, agent, 0] * 5 + starts[:, 0, agent, 1], minlength=25)
        assert (abs(counts - 160) < 60).all()


def test_held_out_starts_follow_from_the_generator_alone():
    starts = CellStarts(EnvConfig())
    assert np.array_equal(starts.held_out(rng(3), 50), starts.held_out(rng(3), 50))
    assert not np.array_equal(starts.held_out(rng(3), 50), starts.held_out(rng(4), 50))


# -- seeds -------------------------------------------------------------------------------------------------------------


def test_seeds_stand_for_starts_of_any_environment():
    starts = SeedStarts(n_prey=2)
    seeds = starts.draw(rng(), 100, 3)
    assert seeds.shape == (100, 3)
    assert seeds.min() >= 0
    assert seeds.max() < 2**31
    assert len(np.unique(seeds)) == 300
    assert starts.held_out(rng(), 5).shape == (5, 1)
    arguments: dict[str, Any] = starts.reset_arguments(seeds[0, 0])
    assert arguments == {"seed": int(seeds[0, 0])}
    assert type(arguments["seed"]) is int


def test_nothing_is_known_of_the_parity_of_seeds():
    starts = SeedStarts(n_prey=2)
    even = starts.even_predators(starts.held_out(rng(), 5))
    assert even.shape == (5, 1, 2)
    assert (even == 0).all()
