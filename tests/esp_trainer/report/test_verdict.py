"""The sentence at the top of a page, from curves that are made up."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from esp_trainer.analysis.cross_play import CrossPlay
from esp_trainer.analysis.phases import Alternation
from esp_trainer.analysis.progress import historical_progress
from esp_trainer.config import RunConfig, SideConfig
from esp_trainer.report.measure import MeasuredRuns
from esp_trainer.report.source import RunSource
from esp_trainer.report.verdict import caught_in_words, fraction_in_words, verdict

N = 12


def run(predators: np.ndarray, prey: np.ndarray, curve: np.ndarray | None = None) -> MeasuredRuns:
    """A run in which predators catch 0.5 of the prey, plus what theirs and less what the prey's generation adds."""
    caught = np.clip(0.5 + predators[:, None] - prey, 0, 1)
    captured = np.zeros((*caught.shape, 2), int)
    captured[..., 0] = np.round(caught * 1000)
    none = np.zeros(caught.shape, int)
    rows, columns = (np.arange(n) * 10 for n in caught.shape)
    own = CrossPlay(rows, columns, captured, np.array([1000, 0]), none, none, 1000)
    curves = {"caught": np.full(120, 0.3) if curve is None else curve}
    source = RunSource("run", Path("run"), RunConfig(), 120, None, curves, {}, {}, ())
    progress = historical_progress(own.caught) if min(caught.shape) > 1 else None
    return MeasuredRuns(source, own=own, progress=progress)


FLAT = np.zeros(N)
RISING = np.linspace(0, 0.4, N)
EARLY = np.minimum(RISING, 0.2)  # as good in the middle as at the end
DIPPING = -np.minimum(RISING, RISING[::-1])  # as good at the end as at the beginning, and worse in the middle


@pytest.mark.parametrize(
    ("predators", "prey", "said"),
    [
        (
            RISING,
            RISING,
            "Both sides were still improving in the second half; late predators catch about 1 in 2 late prey.",
        ),
        (
            RISING,
            EARLY,
            "Only the predators were still improving in the second half; late predators catch about 2 in 3 late prey.",
        ),
        (
            FLAT,
            RISING,
            "Only the prey were still improving in the second half; late predators catch about 1 in 10 late prey.",
        ),
        (
            EARLY,
            FLAT,
            "Only the predators improved, in the first half alone; late predators catch about 2 in 3 late prey.",
        ),
        (FLAT, FLAT, "Neither side improved; late predators catch about 1 in 2 late prey."),
        (DIPPING, FLAT, "Neither side improved; late predators catch about 1 in 2 late prey."),
        (
            EARLY,
            EARLY,
            "Both sides improved, in the first half alone; late predators catch about 1 in 2 late prey.",
        ),
    ],
)
def test_it_says_who_was_still_improving(predators: np.ndarray, prey: np.ndarray, said: str) -> None:
    assert verdict([run(predators, prey)]) == said


def test_a_side_that_is_beaten_has_lost_however_much_it_gained() -> None:
    def ending(level: float, since: int = 1000, n: int = 1500) -> str:
        return verdict([run(RISING, RISING, np.where(np.arange(n) < since, 0.3, level))])

    # The mean over 15 generations is below the bound once its window holds few enough of the earlier ones.
    assert ending(0.0) == "Prey won: after generation 1006 fewer than 1 in 50 are caught."
    assert ending(0.04) == "Prey won: after generation 1006 fewer than 1 in 20 are caught."
    assert ending(0.97) == "Predators won: after generation 1006 fewer than 1 in 20 escape."
    assert ending(0.0, since=0) == "Prey won: from the first generation on fewer than 1 in 50 are caught."
    still = "Both sides were still improving in the second half; late predators catch about 1 in 2 late prey."
    assert ending(0.1) == still
    assert ending(0.0, since=1400) == still  # not for the last sixth of the run


def test_success_that_swings_without_progress_is_no_victory() -> None:
    swinging = replace(run(FLAT, FLAT), alternation=Alternation(5, 0.01))
    assert verdict([swinging]) == (
        "Neither side got ahead for good: success swung to and fro; late predators catch about 1 in 2 late prey."
    )
    assert verdict([replace(swinging, alternation=Alternation(5, 0.2))]).startswith("Neither side improved; ")


def test_several_runs_are_counted() -> None:
    won = run(FLAT, FLAT, np.zeros(100))
    assert verdict([run(RISING, RISING), won, run(RISING, RISING)]) == (
        "In 2 of 3 runs both sides were still improving in the second half; in 1 the prey won."
    )
    assert verdict([won, won]) == "In all 2 runs the prey won."


def test_against_a_script_it_says_whether_the_other_side_learned() -> None:
    hunters = run(RISING, np.zeros(1))
    config = RunConfig(prey=SideConfig(policy="flee_nearest"))
    hunters = replace(hunters, source=replace(hunters.source, config=config))
    assert verdict([hunters]) == (
        "Against the script flee_nearest, the predators got better: at first about 1 in 2 prey is caught, at the end "
        "about 9 in 10 prey are caught."
    )
    config = RunConfig(predators=SideConfig(policy="surround"))
    hunted = run(np.zeros(1), -RISING)
    hunted = replace(hunted, source=replace(hunted.source, config=config))
    assert verdict([hunted]).startswith("Against the script surround, the prey got worse: ")


def test_a_run_of_which_nothing_is_known_has_no_winner() -> None:
    source = run(FLAT, FLAT).source
    assert verdict([MeasuredRuns(source)]) == "Nobody can say who improved: no champion could be read."
    few = run(RISING[:3], RISING[:3])
    assert verdict([few]) == "Nobody can say who improved: that takes champions of at least 4 generations."


def test_a_short_run_has_no_winner_and_no_progress() -> None:
    too_short = "Nobody can say who improved: that takes at least 20 generations."
    for prey in (RISING, np.zeros(1)):  # a side that evolved, and a script
        assert verdict([run(RISING, prey, np.full(19, 0.3))]) == too_short
        assert verdict([run(RISING, prey, np.full(20, 0.3))]) != too_short
    assert verdict([run(RISING, RISING, np.zeros(19))]) == too_short
    assert verdict([run(RISING, RISING, np.zeros(20))]).startswith("Prey won")


def test_fractions_are_told_in_words() -> None:
    assert [fraction_in_words(x) for x in (0.0, 0.03, 0.3, 0.4, 0.61, 0.68, 0.99)] == [
        "nearly no",
        "about 1 in 50",
        "about 1 in 3",
        "about 2 in 5",
        "about 3 in 5",
        "about 2 in 3",
        "nearly all",
    ]
    assert caught_in_words(0.0) == "nearly no prey is caught"
    assert caught_in_words(0.26) == "about 1 in 4 prey is caught"
    assert caught_in_words(0.75) == "about 3 in 4 prey are caught"
