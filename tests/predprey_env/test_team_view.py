"""One team of an environment: the same episodes as if somebody played the whole environment by hand."""

from __future__ import annotations

import copy
import pickle
import warnings
from functools import partial
from typing import Any

import numpy as np
import pytest
from gymnasium.spaces import Box, Discrete
from hypothesis import given
from hypothesis import strategies as st
from pettingzoo.test import parallel_api_test, parallel_seed_test

from predprey_env import EnvConfig, PredPreyEnv, TeamView, team_view
from predprey_env.agents import PREFIXES, other_team
from predprey_env.config import TEAMS, TeamName
from predprey_env.policies import SCRIPTS, ScriptedTeam
from predprey_env.sight import Sight

TINY = {"n_predators": 2, "size": 5, "max_cycles": 30}
ORDERS = ("simultaneous", "prey_first")
MODES = pytest.mark.parametrize("captured_prey", ["inert", "removed"])
TEAM = pytest.mark.parametrize("team", TEAMS)
ORDER = pytest.mark.parametrize("move_order", ORDERS)


class ByHand:
    """The whole environment, played step by step with a script for the other team; what one team gets of it."""

    def __init__(self, config: EnvConfig, team: TeamName, script: str) -> None:
        self.env, self.team, self.others = PredPreyEnv(config), team, other_team(team)
        self.opponent = ScriptedTeam.of(script, self.others, config)
        self.in_turns = config.move_order == "prey_first"

    def reset(self, seed: int | None) -> tuple[Any, ...]:
        self.views, infos = self.env.reset(seed=seed)
        self.opponent.reset(int(self.env.np_random.integers(2**31)))
        if self.in_turns and self.team == "predators":  # the prey have the first move
            self.views, *_, infos = self.env.step(self.answer())
        return self.own(self.views), self.own(infos)

    def step(self, actions: dict[str, int]) -> tuple[Any, ...]:
        if not self.in_turns:
            self.views, *rest = self.env.step(actions | self.answer())
            return tuple(self.own(part) for part in (self.views, *rest))
        ours = self.env.step(actions)
        theirs = self.env.step(self.answer()) if self.env.agents else ({},) * 5
        self.views = theirs[0]
        # Of who is there no more, the first turn says the last word.
        merged = [{**first, **second} for first, second in zip(ours, theirs, strict=True)]
        merged[1] = {agent: reward + theirs[1].get(agent, 0) for agent, reward in ours[1].items()}
        return tuple(self.own(part) for part in merged)

    def answer(self) -> dict[str, int]:
        """The script's actions, for what scripts observe in any world."""
        return self.opponent.act(self.env.observe_as(Sight()))

    def own(self, part: dict[str, Any]) -> dict[str, Any]:
        return {agent: value for agent, value in part.items() if agent.startswith(PREFIXES[self.team])}

    @property
    def agents(self) -> list[str]:
        return list(self.own(dict.fromkeys(self.env.agents)))


def equal(returned: tuple[Any, ...], expected: tuple[Any, ...]) -> None:
    """The same agents in the same order with the same values; rewards, which one of them sums, up to rounding."""
    for part, same in zip(returned, expected, strict=True):
        assert list(part) == list(same)
    for agent, view in returned[0].items():
        assert view.dtype == np.float32
        assert view.tolist() == expected[0][agent].tolist()
    assert returned[1:] == (*[pytest.approx(part, abs=1e-9) for part in expected[1:2]], *expected[2:])


def act(env: Any, random: np.random.Generator) -> dict[str, int]:
    return {agent: int(random.integers(env.action_space(agent).n)) for agent in env.agents}


def compare(config: EnvConfig, team: TeamName, script: str, seed: int) -> int:
    """Play an episode and the start of the next in both; returns how many prey were caught."""
    view, by_hand = TeamView(PredPreyEnv(config), team, script), ByHand(config, team, script)
    random, n_captured = np.random.default_rng(seed), 0.0
    for episode_seed in (seed, None):
        assert_same_start(view.reset(episode_seed), by_hand.reset(episode_seed))
        assert view.agents == by_hand.agents
        while view.agents and (episode_seed is not None or random.random() > 0.2):
            actions = act(view, random)
            returned = view.step(actions)
            equal(returned, by_hand.step(actions))
            assert view.agents == by_hand.agents
            assert view.state().tolist() == by_hand.env.state().tolist()
            n_captured = max(n_captured, *(info["n_captured"] for info in returned[4].values()))
    return int(n_captured)


def assert_same_start(start: tuple[Any, ...], expected: tuple[Any, ...]) -> None:
    assert {agent: view.tolist() for agent, view in start[0].items()} == {
        agent: view.tolist() for agent, view in expected[0].items()
    }
    assert start[1] == expected[1]


# -- against the whole environment --------------------------------------------------------------------------------


@given(config=st.from_type(EnvConfig), team=st.sampled_from(TEAMS), seed=st.integers(0, 2**31), data=st.data())
def test_it_is_the_whole_environment_played_by_hand(
    config: EnvConfig, team: TeamName, seed: int, data: st.DataObject
) -> None:
    compare(config, team, data.draw(st.sampled_from(SCRIPTS[other_team(team)])), seed)


@pytest.mark.parametrize("reward", ["terminal", "dense"])
@MODES
@ORDER
@TEAM
def test_every_combination_agrees_where_prey_are_caught(
    team: TeamName, move_order: str, captured_prey: str, reward: str
) -> None:
    config = EnvConfig(**TINY, move_order=move_order, captured_prey=captured_prey, reward=reward, n_prey=3)
    caught = [compare(config, team, script, seed) for script in SCRIPTS[other_team(team)] for seed in range(6)]
    assert max(caught) == 3


def test_prey_in_turns_by_hand() -> None:
    """A prey moves, the predator sees it and moves: one step."""
    view = team_view("prey", "greedy_chase", n_predators=1, n_prey=1, size=8, max_cycles=2, move_order="prey_first")
    views, infos = view.reset(options={"starts": [[0, 0], [2, 0]]})
    assert views["prey_0"].tolist() == [-2, 0]
    assert infos["prey_0"]["steps"] == 0
    views, rewards, *ends, infos = view.step({"prey_0": 0})  # to (3, 0), the predator to (1, 0)
    assert views["prey_0"].tolist() == [-2, 0]
    assert (rewards, *ends) == ({"prey_0": 0}, {"prey_0": False}, {"prey_0": False})
    views, rewards, *ends, infos = view.step({"prey_0": 2})  # to (3, 1), the predator to (2, 0)
    assert views["prey_0"].tolist() == [-1, -1]
    assert infos["prey_0"]["steps"] == 2
    assert (rewards, *ends) == ({"prey_0": 25}, {"prey_0": False}, {"prey_0": True})
    assert view.agents == []


def test_predators_in_turns_see_where_the_prey_went_before_they_move() -> None:
    view = team_view(
        "predators", "run_straight", n_predators=1, n_prey=1, size=8, max_cycles=9, move_order="prey_first"
    )
    views, infos = view.reset(options={"starts": [[0, 0], [2, 0]]})
    assert views["predator_0"].tolist() == [3, 0]  # it ran already
    assert (infos["predator_0"]["steps"], infos["predator_0"]["in_turn"]) == (1, 1)
    views, *_, infos = view.step({"predator_0": 0})  # to (1, 0), and the prey to (4, 0)
    assert views["predator_0"].tolist() == [3, 0]
    assert (infos["predator_0"]["steps"], infos["predator_0"]["in_turn"]) == (2, 1)


# -- PettingZoo ---------------------------------------------------------------------------------------------------


@TEAM
@MODES
@ORDER
def test_parallel_api(team: TeamName, captured_prey: str, move_order: str) -> None:
    view = team_view(team, "random", **TINY, captured_prey=captured_prey, move_order=move_order)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        parallel_api_test(view, num_cycles=300)
    assert view.max_cycles == view.env.max_cycles == 300  # which that test sets


@TEAM
@ORDER
def test_seeds(team: TeamName, move_order: str) -> None:
    parallel_seed_test(partial(team_view, team, "random", **TINY, move_order=move_order))


@TEAM
def test_all_agents_of_a_team_have_the_same_spaces(team: TeamName) -> None:
    view = team_view(team, "random", n_predators=3, n_prey=2, size=10)
    expected = {
        "predators": (["predator_0", "predator_1", "predator_2"], Box(-5, 4, (4,), np.float32), Discrete(5)),
        "prey": (["prey_0", "prey_1"], Box(-5, 4, (6,), np.float32), Discrete(4)),
    }
    agents, seen, done = expected[team]
    assert view.possible_agents == agents
    for agent in agents:
        assert view.observation_space(agent) is view.observation_space(agent) == view.observation_spaces[agent] == seen
        assert view.action_space(agent) is view.action_space(agent) == view.action_spaces[agent] == done
    view.reset(seed=0)
    assert view.agents == agents
    assert view.state() in view.state_space
    assert str(view) == view.metadata["name"] == "predprey_team_v0"


# -- seeds and copies ---------------------------------------------------------------------------------------------


def episode(view: TeamView, seed: int | None) -> bytes:
    """All views of an episode in which the team does always the same, so that only the world and the opponent vary."""
    record = [view.reset(seed)[0]]
    while view.agents:
        record.append(view.step(dict.fromkeys(view.agents, 0))[0])
    return pickle.dumps([[seen.tolist() for seen in views.values()] for views in record])


@TEAM
@ORDER
def test_the_seed_decides_what_a_random_opponent_does(team: TeamName, move_order: str) -> None:
    view, other = (team_view(team, "random", max_cycles=20, move_order=move_order) for _ in range(2))
    assert episode(view, 3) == episode(other, 3) == episode(view, 3)
    assert episode(view, None) == episode(other, None)  # the stream goes on alike
    assert len({episode(view, seed) for seed in range(20)}) == 20


@TEAM
def test_from_the_same_places_other_seeds_are_other_opponents(team: TeamName) -> None:
    view, walks = team_view(team, "random", max_cycles=20), set()
    for seed in range(10):
        view.reset(seed, options={"starts": [[0, 0], [9, 9], [20, 20], [30, 30], [40, 40]]})
        while view.agents:
            view.step(dict.fromkeys(view.agents, 0))
        walks.add(view.state().tobytes())
    assert len(walks) == 10


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda view: pickle.loads(pickle.dumps(view))])
@pytest.mark.parametrize(("team", "script"), [("predators", "random"), ("prey", "intercept"), ("prey", "random")])
@ORDER
def test_a_copy_in_mid_episode_goes_on_like_the_original(
    team: TeamName, script: str, move_order: str, duplicate: Any
) -> None:
    view = team_view(team, script, max_cycles=30, move_order=move_order)
    view.reset(seed=1)
    for _ in range(5):
        view.step(dict.fromkeys(view.agents, 1))
    twin, states = duplicate(view), []
    for each in (view, twin):
        states.append([])
        while each.agents:
            each.step(dict.fromkeys(each.agents, 1))
            states[-1].append(each.state().tolist())
        states[-1].append(episode(each, None))
    assert states[0] == states[1]
    assert len(states[0]) > 10
