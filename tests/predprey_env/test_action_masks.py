"""Which actions count, in every form of the environment: all but those of caught prey and of agents out of turn."""

from __future__ import annotations

import numpy as np
import pytest

from predprey_env import joint_env, parallel_env, parallel_vector_env, team_view, vector_env

ALL_FOUR, ALL_FIVE, NONE = [1, 1, 1, 1], [1, 1, 1, 1, 1], [1, 0, 0, 0]
WORLD = {"n_predators": 1, "n_prey": 2, "size": 9, "mask_actions": True}
STARTS = [[0, 0], [2, 0], [5, 5]]  # the predator goes east, prey_0 west: they meet in (1, 0)


def test_a_caught_prey_is_left_one_action() -> None:
    env = parallel_env(**WORLD)
    _, infos = env.reset(options={"starts": STARTS})
    assert infos["predator_0"]["action_mask"].tolist() == ALL_FIVE
    assert infos["prey_0"]["action_mask"].tolist() == ALL_FOUR
    assert infos["prey_0"]["action_mask"].dtype == np.int8
    *_, infos = env.step({"predator_0": 0, "prey_0": 1, "prey_1": 2})
    masks = {agent: info["action_mask"].tolist() for agent, info in infos.items()}
    assert masks == {"predator_0": ALL_FIVE, "prey_0": NONE, "prey_1": ALL_FOUR}
    assert env.action_space("prey_0").sample(infos["prey_0"]["action_mask"]) == 0
    no_idling = parallel_env(predator_idle=False, mask_actions=True)
    assert no_idling.reset()[1]["predator_0"]["action_mask"].tolist() == ALL_FOUR


def test_out_of_turn_one_action_is_left() -> None:
    env = parallel_env(**WORLD, move_order="prey_first")
    _, infos = env.reset(options={"starts": STARTS})
    masks = [info["action_mask"].tolist() for info in infos.values()]
    assert masks == [[1, 0, 0, 0, 0], ALL_FOUR, ALL_FOUR]
    *_, infos = env.step({"prey_0": 2, "prey_1": 2})
    assert [info["action_mask"].tolist() for info in infos.values()] == [ALL_FIVE, NONE, NONE]


@pytest.mark.parametrize("move_order", ["simultaneous", "prey_first"])
def test_many_worlds_have_the_masks_of_single_ones(move_order: str) -> None:
    single = team_view("prey", "greedy_chase", **WORLD, move_order=move_order)
    many = vector_env(3, "prey", "greedy_chase", **WORLD, move_order=move_order)
    _, told = single.reset(options={"starts": STARTS})
    _, infos = many.reset(options={"starts": [STARTS] * 3})
    for actions in ({}, {"prey_0": 1, "prey_1": 2}):
        if actions:
            *_, told = single.step(actions)
            *_, infos = many.step([1, 2] * 3)
        expected = np.array([told[agent]["action_mask"] for agent in single.possible_agents] * 3)
        assert infos["action_mask"].dtype == np.int8
        assert infos["action_mask"].tolist() == expected.tolist()
        assert infos["_action_mask"].all()
        assert many.action_masks().tolist() == expected.astype(bool).tolist()
    assert expected.tolist() == [NONE, ALL_FOUR] * 3


def test_both_teams_in_many_worlds_have_them_by_agent() -> None:
    env = parallel_vector_env(2, **WORLD)
    env.reset(options={"starts": [STARTS, STARTS]})
    *_, infos = env.step({"predator_0": [0, 4], "prey_0": [1, 1], "prey_1": [2, 2]})
    assert infos["predator_0"]["action_mask"].tolist() == [ALL_FIVE, ALL_FIVE]
    assert infos["prey_0"]["action_mask"].tolist() == [NONE, ALL_FOUR]


def test_a_team_as_one_agent_has_them_one_agent_after_the_other() -> None:
    env = joint_env("prey", "greedy_chase", n_predators=1, n_prey=2, size=9)
    assert env.action_masks().all()
    env.reset(options={"starts": STARTS})
    assert env.action_masks().tolist() == [True] * 8
    env.step(np.array([1, 2]))
    assert env.action_masks().tolist() == [True, False, False, False, True, True, True, True]


def test_without_the_option_there_are_none() -> None:
    assert "action_mask" not in parallel_env().reset()[1]["prey_0"]
    assert "action_mask" not in vector_env(2).reset()[1]
