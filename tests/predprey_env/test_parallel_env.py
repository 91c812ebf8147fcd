"""What the tools of the ecosystem need of the environment: design.md, section 6."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable

import numpy as np
import pytest
from gymnasium.spaces import Box, Discrete

from predprey_env import EnvConfig, PredPreyEnv

SMALL = EnvConfig(n_predators=2, n_prey=2, size=4, max_cycles=60)
STARTS = [(0, 0), (0, 4), (2, 2), (6, 6)]
Play = Callable[..., list]


def env_of(**fields: object) -> PredPreyEnv:
    return PredPreyEnv(SMALL.replace(**fields))


def equal(first: object, second: object) -> bool:
    """Deep equality, bit by bit, of what an environment returns."""
    return pickle.dumps(_plain(first)) == pickle.dumps(_plain(second))


def _plain(value: object) -> object:
    if isinstance(value, dict):
        return [(key, _plain(part)) for key, part in value.items()]
    if isinstance(value, np.ndarray):
        return str(value.dtype), value.tolist()
    return [_plain(part) for part in value] if isinstance(value, list | tuple) else repr(value)


# -- agents and spaces --------------------------------------------------------------------------------------------


def test_agents_are_named_by_team_and_number_and_are_all_there_after_a_reset() -> None:
    env = env_of()
    assert env.possible_agents == ["predator_0", "predator_1", "prey_0", "prey_1"]
    assert env.agents == []
    env.reset(seed=0)
    assert env.agents == env.possible_agents


@pytest.mark.parametrize("captured_prey", ["inert", "removed"])
def test_possible_agents_never_change(play_randomly: Play, captured_prey: str) -> None:
    env = env_of(captured_prey=captured_prey)
    names = list(env.possible_agents)
    for seed in range(3):
        play_randomly(env, seed)
        assert env.agents == []
        assert env.possible_agents == names


@pytest.mark.parametrize(("size", "low", "high"), [(100, -50, 49), (101, -50, 50)])
def test_spaces_are_flat_bounded_boxes_and_discrete_actions(size: int, low: int, high: int) -> None:
    env = PredPreyEnv(EnvConfig(n_predators=3, n_prey=2, size=size))
    assert env.observation_space("predator_2") == Box(low, high, (4,), np.float32)
    assert env.observation_space("prey_1") == Box(low, high, (6,), np.float32)
    assert env.action_space("predator_2") == Discrete(5)
    assert env.action_space("prey_1") == Discrete(4)
    assert PredPreyEnv(EnvConfig(predator_idle=False)).action_space("predator_0") == Discrete(4)


def test_a_space_is_the_same_object_at_each_call_and_an_agents_own() -> None:
    env = env_of()
    for spaces, by_name in [(env.observation_space, env.observation_spaces), (env.action_space, env.action_spaces)]:
        for agent in env.possible_agents:
            assert spaces(agent) is spaces(agent) is by_name[agent]
        assert len({id(spaces(agent)) for agent in env.possible_agents}) == 4


def test_metadata_and_name() -> None:
    env = env_of()
    assert env.metadata["name"] == str(env) == "predprey_v0"
    assert env.metadata["render_modes"] == ["human", "ansi", "rgb_array"]
    assert env.metadata["render_fps"] > 0
    assert env.metadata["is_parallelizable"] is True
    assert env.unwrapped is env


# -- the end ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("captured_prey", ["inert", "removed"])
def test_after_the_end_a_step_returns_five_empty_dictionaries(play_randomly: Play, captured_prey: str) -> None:
    for limit in (1, 200):
        env = env_of(captured_prey=captured_prey, max_cycles=limit)
        play_randomly(env, seed=0)
        end = env.state().tolist()
        for actions in ({}, {"predator_0": 99}):
            returned = env.step(actions)
            assert returned == ({}, {}, {}, {}, {})
            assert len({id(part) for part in returned}) == 5
            assert env.state().tolist() == end


def test_at_the_time_limit_all_are_truncated_and_none_terminated(play: Play) -> None:
    env = env_of(size=8, max_cycles=3)
    first, second, last = play(env, STARTS, "IIEE", "IIEE", "IIEE")
    for step in (first, second):
        assert set(step.truncations.values()) == set(step.terminations.values()) == {False}
    assert last.truncations == dict.fromkeys(env.possible_agents, True)
    assert last.terminations == dict.fromkeys(env.possible_agents, False)
    assert env.agents == []


def test_a_prey_caught_in_the_last_step_is_truncated_too(play: Play) -> None:
    for captured_prey in ("inert", "removed"):
        (last,) = play(env_of(size=8, max_cycles=1, captured_prey=captured_prey), [*STARTS[:2], (2, 0), (6, 6)], "EIWE")
        assert last.infos["prey_0"]["captured"] == 1
        assert last.truncations == dict.fromkeys(last.observations, True)
        assert last.terminations == {
            agent: captured_prey == "removed" and agent == "prey_0" for agent in last.observations
        }


def test_a_full_catch_terminates_even_at_the_time_limit(play: Play) -> None:
    (last,) = play(env_of(n_prey=1, size=8, max_cycles=1), [(0, 0), (0, 4), (2, 0)], "EIW")
    assert last.terminations == dict.fromkeys(last.observations, True)
    assert last.truncations == dict.fromkeys(last.observations, False)


@pytest.mark.parametrize("captured_prey", ["inert", "removed"])
def test_max_cycles_can_be_written(play_randomly: Play, captured_prey: str) -> None:
    env = PredPreyEnv(EnvConfig(captured_prey=captured_prey, max_cycles=150))
    env.max_cycles = 7
    assert env.max_cycles == env.config.max_cycles == 7
    record = play_randomly(env, seed=0)  # 100 x 100 cells: nobody meets in seven steps
    assert len(record) == 1 + 7
    assert all(record[-1].truncations.values())
    with pytest.raises(ValueError, match=r"^max_cycles must be at least 1, got 0$"):
        env.max_cycles = 0
    assert env.max_cycles == 7


# -- captured prey ------------------------------------------------------------------------------------------------


def test_an_inert_prey_stays_an_agent_and_its_actions_are_ignored(play: Play) -> None:
    starts = [(0, 0), (0, 4), (2, 0), (6, 6)]
    for word in ("IIEE", "IINE", "IISE"):
        env = env_of(size=8)
        caught, after = play(env, starts, "EIWE", word)
        for step in (caught, after):
            assert list(step.observations) == env.possible_agents
            assert not any(step.terminations.values())
            assert step.observations["prey_0"].tolist() == [0, 0, 0, 0]
            assert step.observations["predator_0"].tolist()[:2] == [0, 0]
            assert [step.infos[agent]["captured"] for agent in env.agents] == [0, 0, 1, 0]
        assert env.state().tolist()[2] == env.state().tolist()[0] == 1  # both columns: caught where they met
    for action in (99, -1, None, "north", float("nan")):
        env.step({"predator_0": 4, "predator_1": 4, "prey_0": action, "prey_1": 0})
    env.step({"predator_0": 4, "predator_1": 4, "prey_1": 0})
    assert env.agents == env.possible_agents


def test_a_removed_prey_terminates_and_leaves(play: Play) -> None:
    env = env_of(size=8, captured_prey="removed")
    caught, after = play(env, [(0, 0), (0, 4), (2, 0), (6, 6)], "EIWE", "IIEE")
    assert caught.terminations == {"predator_0": False, "predator_1": False, "prey_0": True, "prey_1": False}
    assert not any(caught.truncations.values())
    assert caught.observations["prey_0"].tolist() == [0, 0, 0, 0]
    assert list(after.observations) == env.agents == ["predator_0", "predator_1", "prey_1"]
    assert after.observations["predator_0"].tolist()[:2] == [0, 0]
    assert [set(part) for part in after] == [set(env.agents)] * 5


# -- dictionaries and arrays --------------------------------------------------------------------------------------


@pytest.mark.parametrize("captured_prey", ["inert", "removed"])
def test_all_that_is_returned_speaks_of_the_agents_that_act(play_randomly: Play, captured_prey: str) -> None:
    env = env_of(captured_prey=captured_prey)
    for seed in range(5):
        observations, infos = env.reset(seed=seed)
        acting = env.agents[:]
        assert list(observations) == list(infos) == acting
        for step in play_randomly(env, seed, reset=False):
            assert all(list(part) == acting for part in step)
            acting = [agent for agent in acting if not (step.terminations[agent] or step.truncations[agent])]
        assert acting == []


def test_values_are_of_plain_types_and_infos_have_the_same_numeric_keys(play_randomly: Play) -> None:
    (observations, infos), *steps = play_randomly(env_of(), seed=0)
    for views in [observations, *(step.observations for step in steps)]:
        assert {(view.dtype, view.ndim) for view in views.values()} == {(np.dtype(np.float32), 1)}
    for step in steps:
        assert {type(reward) for reward in step.rewards.values()} == {float}
        assert {type(end) for end in [*step.terminations.values(), *step.truncations.values()]} == {bool}
    for info in [info for each in [infos, *(step.infos for step in steps)] for info in each.values()]:
        assert {key: type(value) for key, value in info.items()} == {
            "captured": int,
            "n_captured": int,
            "fitness": float,
            "steps": int,
            "in_turn": int,
        }


def scatter(env: PredPreyEnv) -> dict[str, int]:
    """Actions that take every agent elsewhere, so that all views change."""
    return {agent: i for i, agent in enumerate(env.agents)}


def test_every_step_gives_new_dictionaries_and_arrays() -> None:
    env = env_of(size=50)
    given = [env.reset(seed=0)]
    given += [env.step(scatter(env)) for _ in range(3)]
    before = copy.deepcopy(given)
    dictionaries = [part for returned in given for part in returned]
    dictionaries += [info for returned in given for info in returned[-1].values()]
    assert len({id(dictionary) for dictionary in dictionaries}) == len(dictionaries)
    views, *_ = env.step(scatter(env))
    assert equal(given, before)  # nothing that was given out changes later
    assert not equal(given[-1][0], views)


def test_what_a_caller_does_to_its_observations_does_no_harm() -> None:
    meddled, left_alone = env_of(size=50), env_of(size=50)
    for env in (meddled, left_alone):
        env.reset(seed=0)
    for _ in range(3):
        returned = meddled.step(scatter(meddled))
        assert equal(returned, left_alone.step(scatter(left_alone)))
        views, rewards, *_, infos = returned
        views["predator_0"][:] = 77
        assert not any((view == 77).any() for agent, view in views.items() if agent != "predator_0")
        meddled.state()[:] = 77
        rewards.clear()
        infos["prey_0"].clear()


@pytest.mark.parametrize("kind", [np.int64, np.int32, np.uint8, np.array, bool])
def test_integers_of_any_kind_are_actions(kind: Callable[[int], object]) -> None:
    env, plain = env_of(size=50), env_of(size=50)
    for each in (env, plain):
        each.reset(seed=0)
    assert equal(env.step({agent: kind(1) for agent in env.agents}), plain.step(dict.fromkeys(env.agents, 1)))


def test_state_holds_everything_and_lies_in_its_space(play: Play, play_randomly: Play) -> None:
    env = env_of(size=8, max_cycles=4)
    play(env, [(0, 0), (0, 4), (2, 0), (6, 6)], "EIWE")
    # Columns, rows, prey still free, and a quarter of the time.
    assert env.state().tolist() == [1, 0, 1, 7, 0, 4, 0, 6, 0, 1, 0.25]
    assert env.state().dtype == np.float32
    assert env.state_space.shape == (2 * 4 + 2 + 1,)
    for seed in range(3):
        env.reset(seed=seed)
        assert env.state() in env.state_space
        play_randomly(env, seed, reset=False)
        assert env.state() in env.state_space
        assert env.state()[-1] == 1
