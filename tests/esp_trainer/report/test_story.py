"""The lines at the top of a page, from numbers that are made up."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from esp_trainer.analysis.behaviours.counts import BehaviourRate
from esp_trainer.analysis.cross_play import CrossPlay
from esp_trainer.analysis.games import Sides
from esp_trainer.analysis.history import History
from esp_trainer.analysis.moments import Moment
from esp_trainer.analysis.phases import Alternation, Phase
from esp_trainer.analysis.progress import historical_progress
from esp_trainer.config import RunConfig
from esp_trainer.report import moments
from esp_trainer.report.measure import REPORTED_BEHAVIOURS, MeasuredRuns, Watched, never_seen
from esp_trainer.report.source import RunSource
from esp_trainer.report.story import Line, story

N_EPISODES = 100
SOURCE = RunSource("run", Path("run"), RunConfig(), 450, None, {"caught": np.full(450, 0.4)}, {}, {}, ())


def met(caught: np.ndarray) -> CrossPlay:
    """A cross-play of six generations with these shares of prey caught."""
    captured = np.zeros((*caught.shape, 2), int)
    captured[..., 0] = np.round(caught * N_EPISODES)
    none = np.zeros(caught.shape, int)
    generations = np.arange(6) * 10
    return CrossPlay(generations, generations, captured, np.array([N_EPISODES, 0]), none, none, N_EPISODES)


def history(n: int) -> History:
    """A run of this length without champions, whose log is lost."""
    return History(RunConfig(), {}, {"caught": np.full(n, np.nan)}, np.arange(n))


def ladder(predators: float, prey: float) -> np.ndarray:
    """Predators that rise by so much from first to last, and prey likewise."""
    rise = np.linspace(0, 1, 6)
    return 0.5 + predators * (rise[:, None] - 0.5) - prey * (rise - 0.5)


def run(predators: float = 0.3, prey: float = 0.1, **more: Any) -> MeasuredRuns:
    own = met(ladder(predators, prey))
    return MeasuredRuns(SOURCE, own=own, progress=historical_progress(own.caught), **more)


def rate(excess: float) -> BehaviourRate:
    return BehaviourRate(excess + 0.1, 0.1, 100)


def watched(**excesses: list[float]) -> Watched:
    """Four generations in which behaviours are seen so much beyond chance; the others not at all."""
    rates = {
        name: [rate(each) for each in excesses.get(name.replace(" ", "_"), [0.0] * 4)] for name in REPORTED_BEHAVIOURS
    }
    seen = [
        {name: Moment(name, 5, 9, np.zeros((40, 5, 2), int)) for name, all_ in rates.items() if all_[i].excess > 0}
        for i in range(4)
    ]
    return Watched(np.array([0, 10, 20, 30]), rates, seen)


def words(*runs: MeasuredRuns) -> list[str]:
    return [line.words for line in story(runs)]


def figures(*runs: MeasuredRuns) -> list[str]:
    return [line.figures for line in story(runs)]


def ending(level: float, **more: Any) -> MeasuredRuns:
    """A run in whose second half so much prey is caught, champion against champion."""
    source = replace(SOURCE, curves={"caught": np.repeat([0.4, level], 60)})
    return replace(run(**more), source=source)


@pytest.mark.parametrize(
    ("predators", "prey", "said"),
    [
        (0.3, 0.1, "Both sides got better"),
        (0.3, 0.0, "Only the predators got better"),
        (-0.1, 0.2, "Only the prey got better"),
        (0.0, 0.0, "Neither side got better"),
    ],
)
def test_it_says_who_became_better_and_by_how_much(predators: float, prey: float, said: str) -> None:
    line = story([run(predators, prey)])[0]
    assert line.words == f"{said} against the same opponents of the run."
    assert line.figures == (
        f"Against the same opponents of the run, from early to late predators gain {predators:+.2f} of the prey, and "
        f"prey {prey:+.2f}; the smaller gain is {min(predators, prey):+.2f}."
    )


def test_a_side_that_was_left_behind_did_not_get_better() -> None:
    assert words(ending(0.01))[0] == (
        "The prey left the predators behind: late predators gained on early opponents only."
    )
    assert words(ending(0.99))[0].startswith("The predators left the prey behind")
    assert words(ending(0.3))[0].startswith("Both sides got better")
    others = run().progress
    several = words(ending(0.01, met_others=others), ending(0.3, met_others=others))
    assert several[0].endswith("and yet in 1 of 2 runs one side won.")
    assert not any("oth sides got better" in line for line in several)


def test_it_says_what_early_and_late_ones_catch() -> None:
    # Of 0.5 in the middle: 0.15 for the predators' end, 0.05 for the prey's.
    assert figures(run(0.3, 0.1))[1] == (
        "Early predators catch 0.40 of early prey, late ones 0.70; of late prey early predators catch 0.30, "
        "late ones 0.60."
    )
    assert words(run(0.4, 0.2))[1] == (
        "Early predators catch about 2 in 5 early prey, late predators about 4 in 5. Of late prey, early predators "
        "catch about 1 in 5, late predators about 3 in 5."
    )


def test_over_runs_the_interval_decides() -> None:
    sure = [run(0.3 + 0.01 * i, 0.1 + 0.01 * i) for i in (-1, 0, 1)]
    unsure = [run(0.3, 0.1 + 0.3 * i) for i in (-1, 0, 1)]
    nothing = [run(0.3 * i, 0.3 * i) for i in (-1, 0, 1)]
    assert words(*sure)[0].startswith("Both sides got better over the runs")
    assert "predators gain +0.30 [+0.28, +0.32] of the prey" in figures(*sure)[0]
    assert words(*unsure)[0].startswith("Only the predators got better over the runs")
    assert words(*nothing)[0].startswith("Neither side got better over the runs")


def test_it_tells_progress_against_other_seeds_where_there_are_any() -> None:
    def against(gain: float) -> MeasuredRuns:
        both = historical_progress(met(ladder(gain, gain)).caught)
        return run(met_others=Sides(*both))

    three = [against(0.2), against(0.22), against(0.24)]
    assert (
        words(*three)[1] == "Both sides got better over the runs against opponents of other seeds, whom they never met."
    )
    assert figures(*three)[1].startswith(
        "Against opponents of other seeds, from early to late predators gain +0.22 [+0.17, +0.27]"
    )
    assert figures(*three)[1].endswith("p 0.25.")  # of three seeds no test can say more


def test_of_two_runs_there_is_no_interval_and_no_test() -> None:
    def two(*gains: tuple[float, float]) -> list[Line]:
        runs = [run(*gain) for gain in gains]
        return story([replace(each, met_others=each.progress) for each in runs])

    lines = two((0.3, 0.1), (0.34, 0.12))
    assert lines[0].words.startswith("Both sides got better in each of the two runs")
    assert "predators gain +0.32 of the prey, and prey +0.11; the smaller gain is +0.11." in lines[0].figures
    said = "".join(line.figures for line in lines)
    assert "[" not in said
    assert ", p " not in said
    assert two((0.3, 0.1), (0.3, 0.0))[0].words.startswith("Only the predators got better in each of the two runs")
    assert two((0.0, 0.1), (0.3, 0.0))[0].words.startswith("Neither side got better in each of the two runs")


def test_it_says_how_much_goes_in_circles() -> None:
    assert words(run())[2] == "Who beats whom follows a ranking: nothing shows that it goes in circles."
    wheel = np.cos(2 * np.pi * (np.arange(6)[:, None] - np.arange(6)) / 6) / 2 + 0.5
    own = met(wheel)
    round_and_round = MeasuredRuns(SOURCE, own=own, progress=historical_progress(own.caught))
    assert words(round_and_round)[2].startswith("Most of who beats whom goes in circles")
    assert figures(round_and_round)[2] == "1.00 of the win matrix is cyclic, not explained by a ranking."


def test_it_dates_phases() -> None:
    found = (Phase(0, 30, 0.2), Phase(30, 80, 0.5))
    rising = run(phases=found, alternation=Alternation(1, 0.03))
    assert words(rising)[3] == (
        "Success went through 2 phases: at the lowest (from generation 0) about 1 in 5 prey is caught, at the highest "
        "(from generation 30) about 1 in 2. It did not swing to and fro."
    )
    assert figures(rising)[3] == (
        "2 phases, by the prey caught: 0.20 in generations 0 to 29; 0.50 in generations 30 to 79. Success crosses its "
        "mean once; by chance as often with p = 0.03."
    )
    one = run(phases=found[:1], alternation=Alternation(0, 1.0))
    assert words(one)[3] == "No lasting change of success was found: over the whole run about 1 in 5 prey is caught."
    to_and_fro = run(phases=found, alternation=Alternation(3, 0.01))
    assert words(to_and_fro)[3].endswith("It swung to and fro more often than chance would.")
    assert words(one, to_and_fro, rising)[3] == (
        "Success has 1 to 2 phases a run; it swings to and fro in 1 of 3 runs."
    )
    assert "Success has 1 phase a run; it swings to and fro in 0 of 1 run." in words(one, run())[3]


def test_of_many_phases_it_names_the_longest() -> None:
    ends = np.cumsum([0, *range(10, 44)])
    many = tuple(Phase(int(a), int(b), 0.01 * i) for i, (a, b) in enumerate(pairwise(ends)))
    line = story([run(phases=many, alternation=Alternation(9, 0.01))])[3]
    assert "34 phases" in line.words
    assert line.figures.startswith(
        "34 phases, by the prey caught, the 3 longest 0.31 in generations 775 to 815; 0.32 in generations 816 to 857; "
        "0.33 in generations 858 to 900. "
    )


def test_phases_that_are_not_dated_are_not_passed_over_in_silence() -> None:
    assert words(run())[3] == "Nothing can be said of phases: that takes at least 20 generations."
    lost = replace(run(), source=replace(SOURCE, curves={}, history=history(450)))
    assert words(lost)[3] == "Nothing can be said of phases: the log of success is lost."


def test_it_names_each_behaviour_once() -> None:
    seen = watched(attacker=[0.2, 0.3, 0.4, 0.1], baiting=[0.0, 0.03, 0.0, 0.0])
    last = story([run(watched=seen)])[-1]
    assert last.words == "Behaviours seen more often than by chance: attacker."
    assert last.figures.startswith(
        "Behaviours beyond chance, with their peaks: attacker (40% at generation 20). Seen, but not reliably more "
        "often than by chance: baiting. Never seen: blocker, "
    )
    assert all(last.figures.count(name) == 1 for name in REPORTED_BEHAVIOURS)
    many = watched(attacker=[0.4] * 4, blocker=[0.3] * 4, circling=[0.2] * 4, baiting=[0.1] * 4, herding=[0.1] * 4)
    assert words(run(watched=many))[-1] == (
        "Behaviours seen more often than by chance: attacker, blocker, circling, and 2 more."
    )
    assert words(run(watched=watched()))[-1] == "No behaviour is seen more often than by chance."


def test_a_phase_shows_what_sets_it_apart() -> None:
    seen = watched(attacker=[0.5, 0.5, 0.5, 0.5], circling=[0.0, 0.0, 0.3, 0.1])
    runs = [run(phases=(Phase(0, 20, 0.2), Phase(20, 40, 0.4)), watched=seen)]
    (late,) = moments.of_phases(runs)
    assert late["title"] == "Phase 2: circling"
    assert late["text"] == (
        "A prey goes round in a small circle, a predator on its tail. Beyond chance it is seen in 20% of the episodes "
        "of generations 20 to 39, and in 10% of all. In this phase 0.40 of the prey are caught."
    )
    assert (late["generation"], late["behaviour"]) == (20, "circling")
    assert (late["step"], late["until"], late["shown"]) == (5, 9, (0, 17))
    assert moments.why_no_phases(runs) == "Of 2 phases, those with a behaviour of their own are shown."
    assert [moment["behaviour"] for moment in moments.of_behaviours(runs, without=["circling"])] == ["attacker"]


def test_a_behaviour_sets_one_phase_apart_and_many_phases_are_not_all_shown() -> None:
    seen = watched(attacker=[0.9, 0.0, 0.5, 0.0])
    ten = tuple(Phase(start, start + 10, 0.2) for start in (0, 10, 20, 30))
    (first,) = moments.of_phases([run(phases=ten, watched=seen)])
    assert first["title"] == "Phase 1: attacker"


def test_where_no_phase_is_shown_a_line_says_why() -> None:
    def why(**more: Any) -> str:
        runs = [run(**more)]
        assert moments.of_phases(runs) == []
        return moments.why_no_phases(runs)

    level, two = (Phase(0, 40, 0.2),), (Phase(0, 20, 0.2), Phase(20, 40, 0.4))
    seen = watched(attacker=[0.5] * 4)
    assert why(phases=level, watched=seen) == ""  # the story says that there are no phases
    assert why(watched=seen) == ""  # and why nothing can be said of them
    assert why(phases=two, watched=seen) == ("Phases have no pictures: none has a behaviour of its own.")


def test_a_behaviour_shows_where_it_is_seen_most() -> None:
    runs = [run(watched=watched(baiting=[0.1, 0.0, 0.0, 0.0])), run(watched=watched(baiting=[0.0, 0.0, 0.2, 0.1]))]
    (found,) = moments.of_behaviours(runs)
    assert (found["behaviour"], found["run"], found["generation"]) == ("baiting", 1, 20)
    assert found["title"] == "Baiting"
    assert "Seen in 30% of this generation's episodes, by chance in 10%." in found["text"]
    assert "baiting" not in never_seen(runs)
    assert "herding" in never_seen(runs)


def test_without_champions_there_is_nothing_to_say_of_progress() -> None:
    assert words(MeasuredRuns(SOURCE))[0] == "Nothing can be said of progress: no champion could be read."


def test_the_story_of_a_short_run_says_as_little_as_its_verdict() -> None:
    short = replace(run(), source=SOURCE.first(19))
    assert words(short) == ["Nothing can be said of progress or phases: that takes at least 20 generations."]
    assert words(short, short)[0] == words(short)[0]
    assert words(replace(run(), source=SOURCE.first(20)))[0].startswith("Both sides got better")
    few = met(ladder(0.3, 0.1)[:3, :3])
    assert words(replace(run(), own=few))[0] == (
        "Nothing can be said of progress: that takes champions of at least 4 generations."
    )
