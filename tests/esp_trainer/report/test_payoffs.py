"""The words of a page about another game than the predator-prey world, from numbers that are made up."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from esp_trainer.analysis.cross_play import PayoffPlay
from esp_trainer.analysis.phases import Alternation, Phase
from esp_trainer.analysis.progress import historical_progress
from esp_trainer.presets import preset
from esp_trainer.report.charts import charts
from esp_trainer.report.measure import MeasuredRuns
from esp_trainer.report.page import run_page
from esp_trainer.report.source import RunSource
from esp_trainer.report.story import story
from esp_trainer.report.verdict import notable, verdict
from esp_trainer.report.win_matrix import win_matrix

CURVES = {"payoff": np.linspace(-3, 9, 30), "steps": np.full(30, 25.0)}
SOURCE = RunSource("run", Path("run"), preset("game"), 30, None, CURVES, {}, {}, ())
RISING = np.linspace(0, 8, 6)


def run(predators: float, prey: float, variance: float = 0.01, **more: object) -> MeasuredRuns:
    """A run whose predators are paid so much more by the end, and whose prey pay so much less."""
    rise, generations = np.linspace(0, 1, 6), np.arange(6) * 5
    payoff = predators * rise[:, None] - prey * rise
    own = PayoffPlay(generations, generations, payoff, np.full((6, 6), variance), 64)
    return MeasuredRuns(SOURCE, own=own, progress=historical_progress(payoff, 0.0), **more)  # type: ignore[arg-type]


def test_the_verdict_tells_payoffs() -> None:
    said = "Both sides were still improving in the second half; late predators are paid 6.00 by late prey."
    assert verdict([run(8, 2)]) == said
    assert verdict([run(8, 0)]).startswith(
        "Only the predators were still improving in the second half; late predators are"
    )


def test_a_gain_within_the_noise_is_none() -> None:
    assert notable(run(8, 2).own) == 0.02 * 10
    assert notable(run(8, 2, variance=12.0).own) == 2 * np.sqrt(2 * 12 / 6)
    assert verdict([run(8, 2, variance=300.0)]).startswith("Neither side improved; late predators are paid")


def test_the_story_tells_payoffs() -> None:
    phases = (Phase(0, 15, 0.0), Phase(15, 30, 6.0))
    lines = story([run(8, 2, phases=phases, alternation=Alternation(1, 0.4))])
    assert lines[0].words == "Both sides got better against the same opponents of the run."
    assert "predators gain +8.00 in payoff, and prey +2.00" in lines[0].figures
    assert lines[1].words == (
        "Early predators are paid 0.00 by early prey, late predators 8.00. By late prey, early predators are paid "
        "-2.00, late predators 6.00."
    )
    assert lines[2].words.startswith("Who beats whom follows a ranking")
    assert lines[3].words == (
        "Success went through 2 phases: at the lowest (from generation 0) the predators' payoff is 0.00, at the "
        "highest (from generation 15) 6.00. It did not swing to and fro."
    )
    assert lines[3].figures.startswith("2 phases, by the payoff: 0.00 in generations 0 to 14; 6.00 in")
    assert len(lines) == 4  # no behaviours are known


def test_a_run_against_a_random_side_tells_payoffs() -> None:
    source = RunSource(
        "run", Path("run"), preset("game").with_fields({"prey.policy": "random"}), 30, None, CURVES, {}, {}, ()
    )
    own = PayoffPlay(np.arange(6), np.zeros(1, int), RISING[:, None], np.full((6, 1), 0.01), 64)
    met = MeasuredRuns(source, own=own)
    assert verdict([met]) == (
        "Against the script random, the predators got better: at first the predators' payoff is 0.00, at the end the "
        "predators' payoff is 8.00."
    )
    assert story([met])[0].figures == "Against the script random: 0.00 was the payoff early in the run, 8.00 late."


def test_the_charts_have_no_scale_of_fractions() -> None:
    measured = [run(8, 2)]
    found = {chart["id"]: chart for chart in charts(measured)}
    assert set(found) == {"success", "master"}
    assert [trace["name"] for trace in found["success"]["data"]] == ["payoff to the predators"]
    assert [trace["name"] for trace in found["master"]["data"]] == ["predators", "prey"]
    assert "range" not in found["master"]["layout"]["yaxis"]
    told = win_matrix(measured)
    assert told is not None
    assert (told["bottom"], told["top"], told["words"]) == (-2.0, 8.0, "to the predators")


def test_the_page_opens_without_a_player(open_page: Callable[..., Any], tmp_path: Path) -> None:
    file = tmp_path / "page.html"
    file.write_text(run_page([run(8, 2)]), "utf-8")
    tab = open_page(file, near=True)
    tab.until("document.querySelector('#matrix .plot-container')")
    tab.assert_quiet()
    assert tab("() => document.getElementById('play').hidden")
    heat = tab(
        "() => { const [{ zmin, zmax, z }] = document.getElementById('matrix').data; return [zmin, zmax, z[5][0]]; }"
    )
    assert heat == [-2, 8, 8]
    shown = "() => document.querySelector('#tour h2').textContent"
    tab.page.click("#take-tour")
    assert tab(shown) == "1 of 2: What happened"
    tab.page.click("#tour .next")
    assert tab(shown) == "2 of 2: Who beats whom"
    text = tab("() => document.body.innerText")
    assert not [word for word in ("caught", "catch", "torus", "chase") if word in text]
