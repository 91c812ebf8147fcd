from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from predprey_env import EnvConfig, PredPreyEnv
from predprey_env.rules.dynamics import World
from predprey_env.rules.observation import observe

MakeWorld = Callable[..., World]


def view(world: World, agent: int, config: EnvConfig) -> list[float]:
    n_opponents = config.n_prey if agent < config.n_predators else config.n_predators
    out = np.full(2 * n_opponents, np.nan, np.float32)
    assert observe(world, agent, config.rules, out, 0) == 2 * n_opponents
    return out.tolist()


def test_offsets_lead_from_self_to_each_opponent_in_order(make_world: MakeWorld) -> None:
    config = EnvConfig(n_predators=3, n_prey=2)
    world = make_world([(10, 10), (0, 0), (99, 50)], [(13, 6), (98, 99)])
    assert view(world, 0, config) == [3, -4, -12, -11]  # 98 - 10 = 88, or 12 the other way; 99 - 10 = 89, or 11
    assert view(world, 1, config) == [13, 6, -2, -1]
    assert view(world, 2, config) == [14, -44, -1, 49]
    assert view(world, 3, config) == [-3, 4, -13, -6, -14, 44]
    assert view(world, 4, config) == [12, 11, 2, 1, 1, -49]


@pytest.mark.parametrize(("size", "offset"), [(100, -50), (101, 50)])
def test_the_farthest_opponent_is_seen_at_the_edge_of_the_range(make_world: MakeWorld, size: int, offset: int) -> None:
    config = EnvConfig(n_predators=1, n_prey=1, size=size)
    world = make_world([(0, 0)], [(50, 50)])
    assert view(world, 0, config) == [offset, offset]
    assert view(world, 1, config) == [-50, -50]


def test_offsets_to_and_from_a_caught_prey_are_zero(make_world: MakeWorld) -> None:
    config = EnvConfig(n_predators=2, n_prey=2, size=10)
    world = make_world([(1, 1), (2, 2)], [(4, 4), (5, 4)], caught=(0,))
    assert view(world, 0, config) == [0, 0, 4, 3]
    assert view(world, 1, config) == [0, 0, 3, 2]
    assert view(world, 2, config) == [0, 0, 0, 0]
    assert view(world, 3, config) == [-4, -3, -3, -2]


def test_a_view_is_written_from_its_row_on(make_world: MakeWorld) -> None:
    out = np.full(8, 7, np.float32)
    config = EnvConfig(n_predators=2, n_prey=1, size=10)
    assert observe(make_world([(1, 1), (2, 2)], [(4, 5)]), 2, config.rules, out, 3) == 7
    assert out.tolist() == [7, 7, 7, -3, -4, -2, -3, 7]


@given(config=st.from_type(EnvConfig), data=st.data())
def test_opponents_see_each_other_alike_and_inside_the_space(config: EnvConfig, data: st.DataObject) -> None:
    coordinates = st.lists(st.integers(0, config.size - 1), min_size=config.n_agents, max_size=config.n_agents)
    x, y = (np.array(data.draw(coordinates), np.int32) for _ in "xy")
    alive = np.array(data.draw(st.lists(st.integers(0, 1), min_size=config.n_prey, max_size=config.n_prey)), np.int32)
    views = [view(World(x, y, alive), agent, config) for agent in range(config.n_agents)]

    for agent, space in enumerate(PredPreyEnv(config).observation_spaces.values()):
        assert np.array(views[agent], np.float32) in space
    for predator in range(config.n_predators):
        for prey in range(config.n_prey):
            there = views[predator][2 * prey : 2 * prey + 2]
            back = views[config.n_predators + prey][2 * predator : 2 * predator + 2]
            # On an even torus the antipode is at -size / 2 for both.
            assert all((a + b) % config.size == 0 for a, b in zip(there, back, strict=True))
            assert (there == back == [0, 0]) or alive[prey]
