from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from predprey_env import EnvConfig, PredPreyEnv
from predprey_env.config import IDLE, SIGHT_OPTIONS
from predprey_env.policies import ScriptedTeam
from predprey_env.rules.dynamics import World
from predprey_env.rules.observation import observe

MakeWorld = Callable[..., World]


def view(world: World, agent: int, config: EnvConfig, moved: Sequence[int] | None = None) -> list[float]:
    n_seen = config.team("predators" if agent < config.n_predators else "prey").n_seen
    out = np.full(n_seen, np.nan, np.float32)
    last = np.array(moved or [IDLE] * config.n_agents, np.int32)
    assert observe(config.sight, world, last, agent, config.rules, out, 0) == n_seen
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
    world, moved = make_world([(1, 1), (2, 2)], [(4, 5)]), np.full(3, IDLE, np.int32)
    assert observe(config.sight, world, moved, 2, config.rules, out, 3) == 7
    assert out.tolist() == [7, 7, 7, -3, -4, -2, -3, 7]


@given(config=st.from_type(EnvConfig), data=st.data())
def test_opponents_see_each_other_alike_and_inside_the_space(config: EnvConfig, data: st.DataObject) -> None:
    coordinates = st.lists(st.integers(0, config.size - 1), min_size=config.n_agents, max_size=config.n_agents)
    x, y = (np.array(data.draw(coordinates), np.int32) for _ in "xy")
    alive = np.array(data.draw(st.lists(st.integers(0, 1), min_size=config.n_prey, max_size=config.n_prey)), np.int32)
    config = config.replace(see_nearest_first=False, see_scaled=False)
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


# -- options ------------------------------------------------------------------------------------------------------

PLACES = [(10, 10), (0, 0), (99, 50)], [(13, 6), (98, 99)]
EAST, WEST, NORTH, SOUTH = range(4)


def test_team_mates_are_seen_after_the_opponents_without_oneself(make_world: MakeWorld) -> None:
    config, world = EnvConfig(n_predators=3, n_prey=2, see_teammates=True), make_world(*PLACES)
    assert view(world, 1, config) == [13, 6, -2, -1, 10, 10, -1, 50 - 100]
    assert view(world, 4, config) == [12, 11, 2, 1, 1, -49, 15, 7]


def test_last_moves_follow_the_offsets_in_the_same_order(make_world: MakeWorld) -> None:
    world, moved = make_world(*PLACES), [EAST, IDLE, NORTH, WEST, SOUTH]
    config = EnvConfig(n_predators=3, n_prey=2, see_moves=True)
    assert view(world, 0, config, moved) == [3, -4, -12, -11, -1, 0, 0, -1]
    config = config.replace(see_teammates=True)
    assert view(world, 0, config, moved)[8:] == [-1, 0, 0, -1, 0, 0, 0, 1]
    assert view(world, 3, config, moved)[8:] == [1, 0, 0, 0, 0, 1, 0, -1]


def test_the_identity_is_one_number_for_each_agent_of_the_team(make_world: MakeWorld) -> None:
    config, world = EnvConfig(n_predators=3, n_prey=2, see_identity=True), make_world(*PLACES)
    assert [view(world, agent, config)[4:] for agent in range(3)] == [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    assert [view(world, agent, config)[6:] for agent in (3, 4)] == [[1, 0], [0, 1]]


def test_opponents_are_sorted_by_distance_and_their_moves_with_them(make_world: MakeWorld) -> None:
    config = EnvConfig(n_predators=3, n_prey=2, see_nearest_first=True, see_moves=True)
    world, moved = make_world(*PLACES), [EAST, IDLE, NORTH, WEST, SOUTH]
    # Distances from prey_1: 23 to predator_0, 3 to predator_1, 50 to predator_2.
    assert view(world, 4, config, moved) == [2, 1, 12, 11, 1, -49, 0, 0, 1, 0, 0, 1]


def test_opponents_at_equal_distances_keep_their_order(make_world: MakeWorld) -> None:
    config = EnvConfig(n_predators=4, n_prey=1, see_nearest_first=True)
    world = make_world([(12, 10), (10, 8), (10, 11), (9, 9)], [(10, 10)])
    assert view(world, 4, config) == [0, 1, 2, 0, 0, -2, -1, -1]


def test_caught_prey_come_last_and_have_neither_offset_nor_move(make_world: MakeWorld) -> None:
    config = EnvConfig(
        n_predators=1, n_prey=3, see_nearest_first=True, see_moves=True, see_teammates=True, see_identity=True
    )
    world = make_world([(0, 0)], [(5, 0), (0, 0), (2, 0)], caught=(1,))
    moved = [NORTH, EAST, EAST, WEST]
    assert view(world, 0, config, moved) == [2, 0, 5, 0, 0, 0, -1, 0, 1, 0, 0, 0, 1]
    assert view(world, 1, config, moved) == [-5, 0, 0, 0, -3, 0, 0, 1, 0, 0, -1, 0, 1, 0, 0]
    assert view(world, 2, config, moved) == [0] * 12 + [0, 1, 0]


def test_scaled_offsets_are_fractions_of_half_the_torus(make_world: MakeWorld) -> None:
    config = EnvConfig(n_predators=3, n_prey=2, see_scaled=True, see_moves=True, see_teammates=True)
    world, moved = make_world(*PLACES), [EAST, IDLE, NORTH, WEST, SOUTH]
    expected = np.float32([13, 6, -2, -1, 10, 10, -1, -50]) * np.float32(0.02)
    assert view(world, 1, config, moved) == [*expected.tolist(), -1, 0, 0, -1, 1, 0, 0, 1]


options = st.fixed_dictionaries({name: st.booleans() for name in sorted(SIGHT_OPTIONS)})


@given(options, st.integers(3, 9), st.integers(1, 4), st.integers(1, 4), st.integers(0, 2**32 - 1))
def test_observations_are_in_their_space(
    options: dict[str, bool], size: int, hunters: int, prey: int, seed: int
) -> None:
    env = PredPreyEnv(EnvConfig(n_predators=hunters, n_prey=prey, size=size, max_cycles=4, **options))
    observations, _ = env.reset(seed=seed)
    while env.agents:
        for agent, seen in observations.items():
            assert env.observation_space(agent).contains(seen), (seen, env.observation_space(agent))
        observations, *_ = env.step({agent: env.action_space(agent).sample() for agent in env.agents})


@given(st.integers(0, 2**32 - 1))
def test_any_order_by_distance_holds_the_same_opponents(seed: int) -> None:
    random = np.random.default_rng(seed)
    world = World(*random.integers(0, 7, (2, 6), np.int32), np.ones(1, np.int32))
    moved = random.integers(0, 5, 6).tolist()
    config = EnvConfig(n_predators=5, n_prey=1, size=7, see_moves=True)
    plain, ordered = (
        np.reshape(view(world, 5, config.replace(see_nearest_first=nearest), moved), (2, 5, 2))
        .transpose(1, 0, 2)
        .tolist()
        for nearest in (False, True)
    )
    distances = [abs(dx) + abs(dy) or 99 for (dx, dy), _ in plain]
    assert ordered == [plain[i] for i in np.argsort(distances, kind="stable")]


def test_scripts_and_worlds_that_show_more_fit_together_through_observe_as() -> None:
    env = PredPreyEnv(EnvConfig(see_teammates=True, see_moves=True))
    script = ScriptedTeam.of("flee_nearest", "prey", env.config)
    observations, _ = env.reset(seed=0)
    with pytest.raises(ValueError, match=r"^flee_nearest must observe the offsets to 3 opponents, 6 numbers, got 16: "):
        script.act(observations)
    assert list(script.act(env.observe_as(script.sight))) == ["prey_0", "prey_1"]
    assert {agent: len(seen) for agent, seen in env.observe_as(script.sight).items()} == {
        **dict.fromkeys(["predator_0", "predator_1", "predator_2"], 4),
        **dict.fromkeys(["prey_0", "prey_1"], 6),
    }
    with pytest.raises(RuntimeError, match=r"^reset\(\) must be called before observe_as\(\)$"):
        PredPreyEnv().observe_as(script.sight)
