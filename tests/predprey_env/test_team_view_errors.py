"""Mistakes of the caller of a :class:`TeamView` and of its opponent: one line each, and the world left as it was."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from predprey_env import TeamView, team_view
from predprey_env.agents import other_team
from predprey_env.config import TEAMS, TeamName
from predprey_env.policies import ScriptedTeam

WORLD = {"n_predators": 3, "n_prey": 2, "size": 20, "max_cycles": 40}
TEAM = pytest.mark.parametrize("team", TEAMS)
ORDER = pytest.mark.parametrize("move_order", ["simultaneous", "prey_first"])


class Moody:
    """A script that now and then answers something else, without having looked."""

    def __init__(self, team: TeamName, script: str = "random") -> None:
        self.policy = ScriptedTeam(script, team)
        self.answer: Callable[[dict[str, int]], Any] | None = None

    def reset(self, seed: int | None = None) -> None:
        self.policy.reset(seed)

    def act(self, observations: dict[str, np.ndarray]) -> Any:
        if self.answer is not None:
            return self.answer(dict.fromkeys(observations, 0))
        return self.policy.act(observations)


def fail(_: dict[str, int]) -> Any:
    raise OSError("the line is down")


def without_last(actions: dict[str, int]) -> dict[str, int]:
    return dict(list(actions.items())[:-1])


ANSWERS = {
    "raises": (fail, r"^the opponent's act\(\) raised OSError: the line is down$"),
    "misses an agent": (
        without_last,
        r"^the opponent's act\(\) must return an action for each agent: an action for \w+_\d is missing; got .*\]$",
    ),
    "NaN": (lambda actions: dict.fromkeys(actions, float("nan")), r"^the opponent's .* must be an integer, got nan$"),
    "too large": (lambda actions: dict.fromkeys(actions, 5), r"^the opponent's .* must be in 0\.\.[34], got 5$"),
    "negative": (lambda actions: dict.fromkeys(actions, -1), r"^the opponent's .* must be in 0\.\.[34], got -1$"),
    "nothing": (lambda actions: None, r"^the opponent's act\(\) must return a mapping .*, got None$"),
    "too long a list": (lambda actions: [0] * 9, r"^the opponent's act\(\) must return a mapping .*, got \[0, .*\]$"),
    "other agents": (lambda actions: {"wolf_0": 0}, r"^the opponent's .* is missing; got actions for \['wolf_0'\]$"),
    "tuples": (lambda actions: dict.fromkeys(actions, (0, 1)), r"^the opponent's .* an integer, got \(0, 1\)$"),
}


def twins(team: TeamName, script: str = "random", **rules: Any) -> tuple[TeamView, TeamView]:
    views = [team_view(team, Moody(other_team(team), script), **WORLD | rules) for _ in range(2)]
    for view in views:
        view.reset(seed=4)
        view.step(dict.fromkeys(view.agents, 1))
    return views[0], views[1]


def same_future(view: TeamView, twin: TeamView) -> bool:
    """Whether they play on alike: views, rewards, ends and infos of the rest of the episode, and the next start."""
    records = []
    for each in (view, twin):
        records.append([])
        while each.agents:
            observations, *rest = each.step(dict.fromkeys(each.agents, 2))
            records[-1].append(([seen.tolist() for seen in observations.values()], rest))
        records[-1].append([seen.tolist() for seen in each.reset()[0].values()])
    assert len(records[0]) > 10
    return records[0] == records[1]


@pytest.mark.parametrize("answer", ANSWERS)
@pytest.mark.parametrize("captured_prey", ["inert", "removed"])
@ORDER
@TEAM
def test_an_opponents_mistake_is_named_and_does_no_harm(
    team: TeamName, move_order: str, captured_prey: str, answer: str
) -> None:
    view, twin = twins(team, move_order=move_order, captured_prey=captured_prey, reward="dense")
    wrong, line = ANSWERS[answer]
    view.opponent.answer = wrong
    for _ in range(2):
        with pytest.raises((ValueError, RuntimeError), match=line) as raised:
            view.step(dict.fromkeys(view.agents, 0))
        assert "\n" not in str(raised.value)
    assert view.state().tolist() == twin.state().tolist()
    view.opponent.answer = None
    assert same_future(view, twin)


@pytest.mark.parametrize(("team", "script"), [("predators", "flee_nearest"), ("prey", "greedy_chase")])
def test_what_an_opponent_writes_into_its_views_before_it_fails_does_no_harm(team: TeamName, script: str) -> None:
    view, twin = twins(team, script)

    def spoil(observations: dict[str, np.ndarray]) -> Any:
        for seen in observations.values():
            seen[:] = [-7, 3] * (len(seen) // 2)
        raise OSError("the line is down")

    act, view.opponent.act = view.opponent.act, spoil
    with pytest.raises(RuntimeError, match="the line is down"):
        view.step(dict.fromkeys(view.agents, 0))
    view.opponent.act = act
    assert same_future(view, twin)


@pytest.mark.parametrize("seed", [None, 9])
def test_a_reset_in_which_the_opponent_fails_does_no_harm(seed: int | None) -> None:
    """The prey move before the first view of the predators. What they remembered of the last episode is gone."""
    view, twin = twins("predators", "flee_nearest", move_order="prey_first")
    view.opponent.answer = fail
    with pytest.raises(RuntimeError, match=r"^the opponent's act\(\) raised OSError: the line is down$"):
        view.reset(seed)
    view.opponent.answer = None
    assert same_future(view, twin)


@ORDER
@pytest.mark.parametrize(
    ("team", "script"),
    [("predators", "random"), ("predators", "flee_nearest"), ("prey", "random"), ("prey", "greedy_chase")],
)
def test_an_opponent_that_cannot_be_reset_does_no_harm(team: TeamName, script: str, move_order: str) -> None:
    view, twin = twins(team, script, move_order=move_order)
    view.opponent.reset = fail
    with pytest.raises(OSError, match="the line is down"):
        view.reset(9)
    del view.opponent.reset
    assert same_future(view, twin)


def test_a_step_that_is_interrupted_is_as_if_it_never_was() -> None:
    view, twin = twins("prey", move_order="prey_first")

    def interrupted(_: dict[str, int]) -> Any:
        raise KeyboardInterrupt

    view.opponent.answer = interrupted
    with pytest.raises(KeyboardInterrupt):
        view.step(dict.fromkeys(view.agents, 0))
    view.opponent.answer = None
    assert same_future(view, twin)


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"wolf_0": 1}, r"^actions must be for \w+_0, \w+_1(, \w+_2)?, got one for 'wolf_0'$"),
        ({"OTHER_0": 1}, r"^actions must be for \w+_0, \w+_1(, \w+_2)?, got one for '\w+_0'$"),
        ({"OWN_1": None}, r"^the action of \w+_1 must be an integer, got None$"),
        ({"OWN_1": float("nan")}, r"^the action of \w+_1 must be an integer, got nan$"),
        ({"OWN_0": 5}, r"^the action of \w+_0 must be in 0\.\.[34], got 5$"),
        ({"OWN_0": -1}, r"^the action of \w+_0 must be in 0\.\.[34], got -1$"),
    ],
)
@ORDER
@TEAM
def test_the_callers_mistake_is_named_and_does_no_harm(
    team: TeamName, move_order: str, change: dict[str, Any], line: str
) -> None:
    view, twin = twins(team, move_order=move_order)
    own, other = view.possible_agents[0][:-1], ("prey_" if team == "predators" else "predator_")
    wrong = {agent.replace("OWN_", own).replace("OTHER_", other): action for agent, action in change.items()}
    with pytest.raises(ValueError, match=line):
        view.step(dict.fromkeys(view.agents, 0) | wrong)
    assert same_future(view, twin)


@pytest.mark.parametrize("actions", [None, [0, 1], 3])
@TEAM
def test_actions_that_are_no_mapping_are_refused(team: TeamName, actions: Any) -> None:
    view, twin = twins(team)
    with pytest.raises(ValueError, match=r"^actions must be a mapping from agents to actions, got "):
        view.step(actions)
    with pytest.raises(ValueError, match=r"^an action for \w+_0 is missing; got actions for \[\]$"):
        view.step({})
    assert same_future(view, twin)


@ORDER
@TEAM
def test_nothing_works_before_the_first_reset(team: TeamName, move_order: str) -> None:
    view = team_view(team, "random", **WORLD, move_order=move_order)
    for actions in ({}, dict.fromkeys(view.possible_agents, 0)):
        with pytest.raises(RuntimeError, match=r"^reset\(\) must be called before step\(\)$"):
            view.step(actions)
    with pytest.raises(RuntimeError, match=r"^reset\(\) must be called before state\(\)$"):
        view.state()
    assert view.agents == []


@ORDER
@TEAM
def test_after_the_end_a_step_returns_five_empty_dictionaries(team: TeamName, move_order: str) -> None:
    view = team_view(team, "random", **WORLD | {"max_cycles": 2}, move_order=move_order)
    view.reset(seed=0)
    for _ in range(2):
        view.step(dict.fromkeys(view.agents, 0))
    end = view.state().tolist()
    for actions in ({}, dict.fromkeys(view.possible_agents, 0)):
        assert view.step(actions) == ({}, {}, {}, {}, {})
    assert view.state().tolist() == end


@pytest.mark.parametrize("options", [{"starts": [[0, 0]]}, {"starts": [[0, 0]] * 4 + [[0, 20]]}])
def test_a_refused_reset_does_no_harm(options: dict[str, Any]) -> None:
    view, twin = twins("prey")
    with pytest.raises(ValueError, match=r"^starts must "):
        view.reset(seed=1, options=options)
    assert same_future(view, twin)
