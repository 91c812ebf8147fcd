"""The lines at the top of a page, from numbers that are made up."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from esp_trainer.analysis.behaviours.counts import BehaviourRate
from esp_trainer.analysis.cross_play import CrossPlay
from esp_trainer.analysis.games import Sides
from esp_trainer.analysis.moments import Moment
from esp_trainer.analysis.phases import Alternation, Phase
from esp_trainer.analysis.progress import historical_progress
from esp_trainer.config import RunConfig
from esp_trainer.report import moments
from esp_trainer.report.measure import SHOWN, MeasuredRuns, Watched
from esp_trainer.report.source import RunSource
from esp_trainer.report.story import story

N_EPISODES = 100
SOURCE = RunSource("run", Path("run"), RunConfig(), 450, None, {}, {}, {}, ())


def met(caught: np.ndarray) -> CrossPlay:
    """A cross-play of six generations with these shares of prey caught."""
    captured = np.zeros((*caught.shape, 2), int)
    captured[..., 0] = np.round(caught * N_EPISODES)
    none = np.zeros(caught.shape, int)
    generations = np.arange(6) * 10
    return CrossPlay(generations, generations, captured, np.array([N_EPISODES, 0]), none, none, N_EPISODES)


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
    rates = {name: [rate(each) for each in excesses.get(name.replace(" ", "_"), [0.0] * 4)] for name in SHOWN}
    seen = [
        {name: Moment(name, 5, 9, np.zeros((40, 5, 2), int)) for name, all_ in rates.items() if all_[i].excess > 0}
        for i in range(4)
    ]
    return Watched(np.array([0, 10, 20, 30]), rates, seen)


@pytest.mark.parametrize(
    ("predators", "prey", "verdict"),
    [
        (0.3, 0.1, "In this run both sides got better: "),
        (0.3, 0.0, "In this run only the predators got better: "),
        (-0.1, 0.2, "In this run only the prey got better: "),
        (0.0, 0.0, "In this run neither side got better: "),
    ],
)
def test_it_says_who_became_better_and_by_how_much(predators: float, prey: float, verdict: str) -> None:
    first = story([run(predators, prey)])[0]
    assert first.startswith(verdict)
    assert f"predators gain {predators:+.2f} of the prey, and prey {prey:+.2f}; " in first
    assert first.endswith(f"the lesser of the two {min(predators, prey):+.2f}.")


def test_it_says_what_early_and_late_ones_catch() -> None:
    # Of 0.5 in the middle: 0.15 for the predators' end, 0.05 for the prey's.
    assert story([run(0.3, 0.1)])[1] == (
        "Early predators catch 0.40 of early prey, late ones 0.70; of late prey early predators catch 0.30, "
        "late ones 0.60."
    )


def test_over_runs_the_interval_decides() -> None:
    sure = [run(0.3 + 0.01 * i, 0.1 + 0.01 * i) for i in (-1, 0, 1)]
    unsure = [run(0.3, 0.1 + 0.3 * i) for i in (-1, 0, 1)]
    assert story(sure)[0].startswith("Both sides made progress")
    assert "predators gain +0.30 [+0.28, +0.32] of the prey" in story(sure)[0]
    assert story(unsure)[0].startswith("The predators made progress, the other side none that can be shown")
    nothing = [run(0.3 * i, 0.3 * i) for i in (-1, 0, 1)]
    assert story(nothing)[0].startswith("No progress can be shown")


def test_it_tells_progress_against_other_seeds_where_there_are_any() -> None:
    def against(gain: float) -> MeasuredRuns:
        both = historical_progress(met(ladder(gain, gain)).caught)
        return run(met_others=Sides(*both))

    second = story([against(0.2), against(0.22), against(0.24)])[1]
    assert second.startswith(
        "Against opponents of other seeds, whom they never met, from early to late predators gain +0.22 [+0.17, +0.27]"
    )
    assert second.endswith("p 0.25.")  # of three seeds no test can say more


def test_of_two_runs_there_is_no_interval_and_no_test() -> None:
    def two(*gains: tuple[float, float]) -> list[str]:
        runs = [run(*gain) for gain in gains]
        return story([replace(each, met_others=each.progress) for each in runs])

    lines = two((0.3, 0.1), (0.34, 0.12))
    assert lines[0].startswith(
        "Both sides got better in each of the two runs: against the same opponents of their run, "
    )
    assert "predators gain +0.32 of the prey, and prey +0.11; the lesser of the two +0.11." in lines[0]
    assert "[" not in "".join(lines)
    assert ", p " not in "".join(lines)
    assert two((0.3, 0.1), (0.3, 0.0))[0].startswith("Only the predators got better in each of the two runs: ")
    assert two((0.0, 0.1), (0.3, 0.0))[0].startswith("No side got better in each of the two runs: ")


def test_it_says_how_much_goes_in_circles() -> None:
    assert story([run()])[2] == (
        "Who beats whom is a ladder of strength: that any of it depends on the opponent cannot be shown."
    )
    wheel = np.cos(2 * np.pi * (np.arange(6)[:, None] - np.arange(6)) / 6) / 2 + 0.5
    own = met(wheel)
    round_and_round = MeasuredRuns(SOURCE, own=own, progress=historical_progress(own.caught))
    assert "Of who beats whom, 1.00 depends on the opponent" in story([round_and_round])[2]


def test_it_dates_phases() -> None:
    found = (Phase(0, 30, 0.2), Phase(30, 80, 0.5))
    assert story([run(phases=found, alternation=Alternation(1, 0.03))])[3] == (
        "Success has 2 phases, by the prey caught: 0.20 from generation 0, 0.50 from generation 30. It crosses its "
        "mean once; by chance as often with p = 0.03."
    )
    one = run(phases=found[:1], alternation=Alternation(0, 1.0))
    assert story([one])[3] == "Success has no phases: 0.20 of the prey are caught from first to last."
    to_and_fro = run(phases=found, alternation=Alternation(3, 0.01))
    rising = run(phases=found, alternation=Alternation(1, 0.01))
    assert "Success has 1 to 2 phases a run; in 1 of 3 runs it goes to and fro" in story([one, to_and_fro, rising])[3]
    assert "Success has 1 phase a run; in 0 of 1 runs" in story([one, run()])[3]


def test_it_names_behaviours_that_were_seen_on_the_whole_and_those_that_were_not() -> None:
    seen = watched(attacker=[0.2, 0.3, 0.4, 0.1], baiting=[0.0, 0.03, 0.0, 0.0])
    last = story([run(watched=seen)])[-1]
    assert last.startswith("Behaviours beyond chance, with their peaks: attacker (40% at generation 20).")
    assert "Next to none: blocker," in last
    assert "baiting" in last.split("Next to none")[1]


def test_a_phase_shows_what_sets_it_apart() -> None:
    seen = watched(attacker=[0.5, 0.5, 0.5, 0.5], circling=[0.0, 0.0, 0.3, 0.1])
    found = (Phase(0, 20, 0.2), Phase(20, 40, 0.4))
    early, late = moments.of_phases([run(phases=found, watched=seen)])
    assert (early["behaviour"], late["behaviour"]) == ("attacker", "circling")
    assert "Nothing sets it apart; most often it is attacker" in early["text"]
    assert (
        "What sets it apart most is circling: in 20% of its episodes beyond chance, 10% in the whole run"
        in late["text"]
    )
    assert late["generation"] == 20
    assert (late["step"], late["until"], late["shown"]) == (5, 9, (0, 17))


def test_a_run_without_phases_shows_none() -> None:
    assert moments.of_phases([run(phases=(Phase(0, 40, 0.2),), watched=watched(attacker=[0.5] * 4))]) == []


def test_a_behaviour_shows_where_it_is_seen_most() -> None:
    runs = [run(watched=watched(baiting=[0.1, 0.0, 0.0, 0.0])), run(watched=watched(baiting=[0.0, 0.0, 0.2, 0.1]))]
    (found,) = moments.of_behaviours(runs)
    assert (found["behaviour"], found["run"], found["generation"]) == ("baiting", 1, 20)
    assert found["title"] == "Baiting"
    assert "In 30% of its generation's episodes, by chance in 10%." in found["text"]
    assert "baiting" not in moments.never_seen(runs)
    assert "herding" in moments.never_seen(runs)


def test_without_champions_there_is_nothing_to_say_of_progress() -> None:
    assert story([MeasuredRuns(SOURCE)]) == ["No champion could be read, so nothing can be said of progress."]
