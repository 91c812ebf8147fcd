"""Mistakes of whoever plays the other team in many worlds: one line each, and the worlds left as they were."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from predprey_env import vector_env
from predprey_env.agents import other_team
from predprey_env.config import TEAMS, EnvConfig, TeamName
from predprey_env.policies import ScriptedTeam
from predprey_env.policies.outside import OutsideTeam

NEXT_STEP, SAME_STEP = AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP
SMALL = {"n_predators": 2, "n_prey": 2, "size": 7, "max_cycles": 6, "reward": "dense"}


def twins(team: TeamName, opponent: Callable[[], Any], mode: AutoresetMode = NEXT_STEP, **rules: Any) -> list[Any]:
    envs = [vector_env(3, team, opponent(), mode, **SMALL | rules) for _ in range(2)]
    for env in envs:
        env.reset(seed=4)
        env.step(np.ones(6, int))
    return envs


class Moody:
    """Scripts that share a mood: what they answer instead, and how often they look before that."""

    mood: dict[str, Any]

    def __init__(self, team: TeamName, script: str = "random") -> None:
        self.policy = ScriptedTeam(script, team)

    def reset(self, seed: int | None = None) -> None:
        self.policy.reset(seed)

    def act(self, observations: dict[str, np.ndarray]) -> Any:
        Moody.mood["patience"] -= 1
        if Moody.mood["patience"] < 0:
            return Moody.mood["answer"](observations)
        return self.policy.act(observations)


class MoodyBatch(Moody):
    """The same, asked for all worlds at once."""

    def act_batch(self, views: np.ndarray) -> Any:
        Moody.mood["patience"] -= 1
        return Moody.mood["answer"](views) if Moody.mood["patience"] < 0 else np.abs(views).sum(2).astype(int) % 4


@pytest.fixture(autouse=True)
def mood() -> dict[str, Any]:
    """How the opponents of a test feel; good-humoured at first."""
    Moody.mood = {"patience": 10**9, "answer": None}
    return Moody.mood


def fail(_: Any) -> Any:
    raise OSError("the line is down")


ANSWERS = [
    (fail, r"^the opponent's act\(\) raised OSError: the line is down$"),
    (lambda views: dict.fromkeys(views, 5), r"^the opponent's .* must be in 0\.\.[34], got 5$"),
    (lambda views: dict.fromkeys(views, float("nan")), r"^the opponent's .* must be an integer, got nan$"),
    (lambda views: {}, r"^the opponent's .* is missing; got actions for \[\]$"),
    (lambda views: [0] * 9, r"^the opponent's act\(\) must return a mapping .*$"),
]
BATCHES = [
    (fail, r"^the opponent's act_batch\(\) raised OSError: the line is down$"),
    (lambda views: None, r"^.* must return integers of shape \(3, 2\), got object of shape \(\)$"),
    (lambda views: np.zeros((3, 3), int), r"^.* must return integers of shape \(3, 2\), got int64 of shape \(3, 3\)$"),
    (lambda views: np.zeros((3, 2)), r"^.* must return integers of shape \(3, 2\), got float64 of shape \(3, 2\)$"),
    (lambda views: np.full((3, 2), 5), r"^.* must return actions in 0\.\.[34], got 5 to 5$"),
    (lambda views: np.full((3, 2), -1), r"^.* must return actions in 0\.\.[34], got -1 to -1$"),
]
FAULTS = [(Moody, *fault) for fault in ANSWERS] + [(MoodyBatch, *fault) for fault in BATCHES]


@pytest.mark.parametrize(("kind", "answer", "line"), FAULTS)
@pytest.mark.parametrize("move_order", ["simultaneous", "prey_first"])
@pytest.mark.parametrize("team", TEAMS)
def test_an_opponents_mistake_is_named_and_does_no_harm(
    team: TeamName,
    move_order: str,
    kind: type[Moody],
    answer: Any,
    line: str,
    mood: dict[str, Any],
    same_future: Callable[..., bool],
) -> None:
    env, twin = twins(team, lambda: kind(other_team(team)), move_order=move_order, mode=SAME_STEP)
    mood.update(answer=answer, patience=0)
    for _ in range(2):
        with pytest.raises((ValueError, RuntimeError), match=line):
            env.step(np.zeros(6, int))
    mood["patience"] = 10**9
    assert same_future(env, twin)


@pytest.mark.parametrize("kind", [Moody, MoodyBatch])
@pytest.mark.parametrize("mode", [NEXT_STEP, SAME_STEP])
def test_a_mistake_in_the_first_turn_of_an_episode_does_no_harm_either(
    kind: type[Moody], mode: AutoresetMode, mood: dict[str, Any], same_future: Callable[..., bool]
) -> None:
    """Where prey move first, they do so within the step that starts the next episode, before the predators look."""
    env, twin = twins("predators", lambda: kind("prey"), move_order="prey_first", mode=mode, max_cycles=2, size=30)
    last = np.zeros(6, int)
    if mode is NEXT_STEP:  # both are over after this
        for each in (env, twin):
            each.step(last)
    mood.update(answer=fail, patience=0)
    with pytest.raises(RuntimeError, match=r"^the opponent's \w+\(\) raised OSError: the line is down$"):
        env.step(last)
    mood["patience"] = 10**9
    assert same_future(env, twin)


@pytest.mark.parametrize("kind", [Moody, MoodyBatch])
@pytest.mark.parametrize("seed", [None, 9])
def test_a_reset_in_which_the_opponent_fails_does_no_harm(
    kind: type[Moody], seed: int | None, mood: dict[str, Any], same_future: Callable[..., bool]
) -> None:
    """But what it remembered of the last episode is gone."""
    env, twin = twins("predators", lambda: kind("prey", "flee_nearest"), move_order="prey_first")
    mood.update(answer=fail, patience=0)
    with pytest.raises(RuntimeError, match=r"^the opponent's \w+\(\) raised OSError: the line is down$"):
        env.reset(seed=seed)
    mood["patience"] = 10**9
    assert same_future(env, twin)


def test_a_first_reset_that_fails_is_none(mood: dict[str, Any]) -> None:
    env = vector_env(3, "predators", Moody("prey"), **SMALL, move_order="prey_first")
    mood.update(answer=fail, patience=0)
    with pytest.raises(RuntimeError, match="the line is down"):
        env.reset(seed=1)
    with pytest.raises(RuntimeError, match=r"^reset\(\) must be called before step\(\)$"):
        env.step(np.zeros(6, int))


class Answers:
    """Answers what it was told to, and notes how often it was asked."""

    asked = 0

    def __init__(self, answer: Callable[[Any], Any]) -> None:
        self.answer = answer

    def reset(self, seed: int | None = None) -> None:
        pass

    def act(self, observations: dict[str, np.ndarray]) -> Any:
        Answers.asked += 1
        return self.answer(observations)


class AnswersBatch(Answers):
    def act_batch(self, views: np.ndarray) -> Any:
        return self.answer(views)


@pytest.mark.parametrize(("kind", "faults"), [(Answers, ANSWERS), (AnswersBatch, BATCHES)])
def test_a_mistake_is_told_as_that_of_whoever_it_is(kind: type[Answers], faults: list[Any]) -> None:
    env = EnvConfig(n_predators=2)
    for answer, _ in faults:
        lines = []
        for named in ({"whose": "the guest's"}, {}):
            with pytest.raises((ValueError, RuntimeError)) as refused:
                OutsideTeam(kind(answer), env, "prey", 3, **named).act(np.ones(3, bool))
            lines.append(str(refused.value))
        assert lines[0].startswith("the guest's act")
        assert lines[1] == lines[0].replace("the guest's", "the opponent's")


def test_only_worlds_that_go_on_are_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Answers, "asked", 0)
    team = OutsideTeam(Answers(lambda views: dict.fromkeys(views, 3)), EnvConfig(), "prey", 4)
    actions = team.act(np.array([True, False, False, True]))
    assert Answers.asked == 2
    assert actions[[0, 3]].tolist() == [[3, 3], [3, 3]]
