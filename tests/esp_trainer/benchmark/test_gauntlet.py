"""What a way through the gauntlet says, on games small enough to work out by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from esp_trainer.benchmark import gauntlet
from esp_trainer.benchmark.gauntlet import Gauntlet, OpponentResult, part_of
from esp_trainer.benchmark.match import Meeting
from esp_trainer.statistics import wilson_of
from esp_trainer.tasks import WORLDS
from esp_trainer.teams.zoo import Zoo, load_zoo
from esp_trainer.types import Role, ScriptedTeams

ENV = WORLDS["3v1"]
ROCK_PAPER_SCISSORS = np.array([[50, 0, 100], [100, 50, 0], [0, 100, 50]])
HELD, OPEN, SCRIPT = (
    "held-out/x-3v1/{}/seed-1-late",
    "x-3v1/{}/seed-2-late",
    {"prey": "random", "predators": "intercept"},
)


def names(role: str) -> tuple[str, ...]:
    """One of each part, in an order that is not that of the gauntlet."""
    return SCRIPT[role], OPEN.format(role), HELD.format(role)


def zoo(captured: np.ndarray, n_episodes: int = 100) -> Zoo:
    return Zoo("3v1", (), names("predators"), names("prey"), captured, n_episodes, 1, "digest")


def rows(role: Role, shares: list[float]) -> list[OpponentResult]:
    """The candidate's, in the order of the zoo's matrix turned round."""
    other = "prey" if role == "predators" else "predators"
    found = [
        OpponentResult(n, part_of(n), wilson_of(s, 100), 0.0, None) for n, s in zip(names(other), shares, strict=True)
    ]
    return found[::-1]


def standing(role: Role, shares: list[float], captured: np.ndarray = ROCK_PAPER_SCISSORS) -> Any:
    return Gauntlet(zoo(captured), ENV, role, 100, 0).standing(rows(role, shares))


def test_the_value_of_rock_paper_scissors_is_a_half_and_gain_is_what_is_beyond_it():
    found = standing("predators", [0.6, 0.6, 0.6])
    assert found.gain == pytest.approx(0.1)
    assert found.exploited == pytest.approx(-0.1)
    found = standing("predators", [0.9, 0.3, 0.3])
    assert found.gain == pytest.approx(0.0)
    assert found.exploited == pytest.approx(0.2)


def test_prey_are_scored_by_what_is_not_caught():
    found = standing("prey", [0.4, 0.4, 0.1])
    assert found.gain == pytest.approx((0.6 + 0.6 + 0.9) / 3 - 0.5)
    assert found.exploited == pytest.approx(-0.1)
    assert found.generalist == {
        "scripts": pytest.approx((0.6, 0.6)),
        "zoo": pytest.approx((0.6, 0.6)),
        "held out": pytest.approx((0.9, 0.9)),
    }


def test_the_optimal_mixture_may_be_one_opponent():
    """Prey of the second column are caught least by everybody, so that only they count."""
    captured = np.array([[90, 20, 80], [80, 10, 90], [70, 30, 70]])
    found = standing("predators", [1.0, 0.5, 1.0], captured)
    assert found.gain == pytest.approx(0.5 - 0.3)
    assert found.exploited == pytest.approx(0.3 - 0.5)


@pytest.mark.parametrize("role", ["predators", "prey"])
def test_who_beats_everybody_is_first_and_who_beats_nobody_last(role: Role):
    wins, loses = ([1.0] * 3, [0.0] * 3) if role == "predators" else ([0.0] * 3, [1.0] * 3)
    best, worst = standing(role, wins), standing(role, loses)
    assert (best.rank, best.of) == (1, 4)
    assert (worst.rank, worst.of) == (4, 4)
    assert best.rating.low < best.rating.rate < best.rating.high
    assert best.rating.low > worst.rating.high


def test_a_candidate_that_does_as_a_known_team_is_rated_as_it_is():
    captured = np.array([[70, 60, 80], [40, 30, 50], [10, 20, 30]])
    middle = standing("predators", [0.4, 0.3, 0.5], captured)
    assert middle.rank == 2
    more = standing("predators", [0.41, 0.31, 0.51], captured)
    assert more.rating.rate > middle.rating.rate


def test_the_worst_tenth_is_that_of_the_scores_it_does_worst_in():
    zoo_of_many = Zoo(
        "3v1",
        (),
        ("intercept",),
        tuple(f"x-3v1/prey/seed-{i}-late" for i in range(20)),
        np.full((1, 20), 50),
        100,
        1,
        "digest",
    )
    found = [OpponentResult(name, "zoo", wilson_of(i / 20, 100), 0.0, None) for i, name in enumerate(zoo_of_many.prey)]
    told = Gauntlet(zoo_of_many, ENV, "predators", 100, 0).standing(found[::-1])
    assert told.generalist == {"zoo": pytest.approx((0.475, 0.025))}


# Meetings become rows.


class ToldArena:
    """Says what came of a meeting, and notes who met."""

    def __init__(self, *_: Any) -> None:
        self.met: list[tuple[Any, Role, Any]] = []

    def meet(self, *who: Any) -> Meeting:
        self.met.append(who)
        captured = np.array([2, 0, 1, 2])
        return Meeting(captured, np.array([25.0, 5.0, 12.0, 25.0]), np.array([40, 150, 150, 60]))


def test_rows_come_from_meetings_with_everybody_held_out_first(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(gauntlet, "Arena", ToldArena)
    monkeypatch.setattr(gauntlet, "load_team", lambda name: f"the team {name}")
    played = Gauntlet(zoo(ROCK_PAPER_SCISSORS), WORLDS["3v2"], "predators", 4, 0)
    found = list(played.play("candidate"))  # type: ignore[arg-type]
    assert [row.part for row in found] == ["held out", "zoo", "scripts"]
    held, opened, script = HELD.format("prey"), OPEN.format("prey"), SCRIPT["prey"]
    assert [row.opponent for row in found] == [held, opened, script]
    opponents: list[Any] = [f"the team {held}", f"the team {opened}", ScriptedTeams(script)]
    assert played._arena.met == [("candidate", "predators", opponent) for opponent in opponents]  # type: ignore[attr-defined]
    assert found[0] == OpponentResult(held, "held out", wilson_of(5 / 8, 4), 16.75, 50.0)


def test_where_never_all_were_caught_there_is_no_time_to_it(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(gauntlet, "Arena", ToldArena)
    monkeypatch.setattr(gauntlet, "load_team", str)
    found = list(
        Gauntlet(zoo(ROCK_PAPER_SCISSORS), WORLDS["3v2"].replace(n_prey=3), "predators", 4, 0).play("candidate")
    )  # type: ignore[arg-type]
    assert [row.all_caught_after for row in found] == [None] * 3


@pytest.mark.parametrize("role", ["predators", "prey"])
def test_everybody_of_the_zoo_and_every_script_is_met(role: Role):
    known = load_zoo("3v2")
    assert sorted(Gauntlet(known, WORLDS["3v2"], role, 8, 0).opponents) == sorted(
        known.prey if role == "predators" else known.predators
    )


def test_prey_play_the_game_turned_round():
    """Three predators against two prey, where no transposed or mirrored game has the same value.

    Not caught are 0.8 and 0.2 of one prey, 0.2 and 0.8 of the other, so that the first two predators are mixed half and
    half, for a value of 0.5; the third catches less of both and is left out.
    """
    captured = np.array([[20, 80], [80, 20], [40, 10]])
    known = Zoo("3v1", (), names("predators"), names("prey")[:2], captured, 100, 1, "digest")
    found = Gauntlet(known, ENV, "prey", 100, 0).standing(rows("prey", [0.3, 0.5, 1.0]))
    assert found.gain == pytest.approx((0.7 + 0.5) / 2 - 0.5)
    assert found.exploited == pytest.approx(0.5 - 0.0)
    assert found.of == 3


def test_a_candidate_that_played_less_is_rated_less_surely():
    shares = [0.6, 0.6, 0.6]
    few, many = (
        Gauntlet(zoo(ROCK_PAPER_SCISSORS), ENV, role, n_episodes, 0).standing(rows(role, shares)).rating
        for role, n_episodes in (("predators", 16), ("predators", 1600))
    )
    assert few.high - few.low > 3 * (many.high - many.low)


def test_the_part_of_an_opponent_is_in_its_name():
    assert [part_of(name) for name in names("prey")] == ["scripts", "zoo", "held out"]
    assert [part_of(name) for name in names("predators")] == ["scripts", "zoo", "held out"]
    assert part_of("held-out/drawn-3v1/prey/seed-901-late") == "older held out"
    assert part_of("held-out/race-3v1/prey/seed-901-late") == "held out"
