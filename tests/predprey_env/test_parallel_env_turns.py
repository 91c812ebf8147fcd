"""`move_order="prey_first"`: a time step is two calls of step(), in which the prey and then the predators move."""

from __future__ import annotations

import copy
from collections.abc import Callable

import pytest

from predprey_env import EnvConfig, PredPreyEnv

CONFIG = EnvConfig(n_predators=1, n_prey=2, size=8, max_cycles=2, move_order="prey_first")
STARTS = [(0, 0), (2, 0), (4, 4)]
Play = Callable[..., list]


def test_the_prey_move_and_the_predators_see_it_before_they_move(play: Play) -> None:
    env = PredPreyEnv(CONFIG)
    prey_moved, predators_moved = play(env, STARTS, "EEN", "EEN")
    assert prey_moved.observations["predator_0"].tolist() == [3, 0, -4, -3]
    assert predators_moved.observations["predator_0"].tolist() == [2, 0, 3, -3]
    assert predators_moved.observations["prey_0"].tolist() == [-2, 0]


def test_each_turn_asks_for_the_actions_of_its_team_only() -> None:
    env = PredPreyEnv(CONFIG)
    env.reset(options={"starts": STARTS})
    with pytest.raises(ValueError, match=r"^an action for prey_0 is missing; got actions for \['predator_0'\]$"):
        env.step({"predator_0": 0})
    env.step({"prey_0": 0, "prey_1": 0, "predator_0": 99})
    with pytest.raises(
        ValueError, match=r"^an action for predator_0 is missing; got actions for \['prey_0', 'prey_1'\]$"
    ):
        env.step({"prey_0": 0, "prey_1": 0})
    env.step({"predator_0": 0, "prey_0": None})
    assert env.state().tolist()[:6] == [1, 3, 5, 0, 0, 4]


def test_the_time_limit_counts_whole_steps(play: Play) -> None:
    steps = play(PredPreyEnv(CONFIG), STARTS, "IEE", "IEE", "IEE", "IEE")
    assert [step.infos["prey_0"]["steps"] for step in steps] == [1, 1, 2, 2]
    assert [step.truncations["prey_0"] for step in steps] == [False, False, False, True]


def test_the_clock_in_the_state_goes_by_halves() -> None:
    env = PredPreyEnv(CONFIG)
    env.reset(seed=0, options={"starts": STARTS})
    clock = [float(env.state()[-1])]
    while env.agents:
        env.step(dict.fromkeys(env.agents, 0))
        clock.append(float(env.state()[-1]))
    assert clock == [0, 0.25, 0.5, 0.75, 1]


@pytest.mark.parametrize("captured_prey", ["inert", "removed"])
def test_a_prey_that_walks_into_a_predator_is_caught_at_once(play: Play, captured_prey: str) -> None:
    env = PredPreyEnv(CONFIG.replace(captured_prey=captured_prey))
    (step,) = play(env, [(1, 0), (2, 0), (4, 4)], "EWN")
    assert [step.infos[agent]["captured"] for agent in step.infos] == [0, 1, 0]
    assert step.terminations["prey_0"] == (captured_prey == "removed")
    assert step.rewards["prey_0"] == (12.5 if captured_prey == "removed" else 0)


def test_an_episode_ends_after_the_predators_turn_and_pays_the_papers_fitness(play: Play) -> None:
    env = PredPreyEnv(CONFIG.replace(n_prey=1, max_cycles=10))
    # Moves east in step 1, and in step 2 walks back into the predator that follows.
    steps = play(env, STARTS[:2], "IE", "EI", "IW", "EI")
    assert [set(step.terminations.values()) for step in steps] == [{False}, {False}, {False}, {True}]
    assert steps[-1].rewards == {"predator_0": 25.0, "prey_0": 12.5 * 2 / 10}
    assert env.agents == []


def test_a_new_episode_begins_with_the_prey(play: Play) -> None:
    env = PredPreyEnv(CONFIG)
    play(env, STARTS, "EEN")  # abandoned before the predators' turn
    (step,) = play(env, STARTS, "EEN")
    assert step.observations["predator_0"].tolist() == [3, 0, -4, -3]


def test_a_copy_between_two_turns_goes_on_like_the_original(play: Play) -> None:
    env = PredPreyEnv(CONFIG)
    play(env, STARTS, "EEN")
    twin = copy.deepcopy(env)
    for _ in range(3):
        states = []
        for each in (env, twin):
            each.step({"predator_0": 0, "prey_0": 1, "prey_1": 2})
            states.append(each.state().tolist())
        assert states[0] == states[1]
    assert env.agents == twin.agents == []
