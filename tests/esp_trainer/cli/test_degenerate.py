"""Runs in which there is nothing to divide, and as little of everything as may be asked for, are told in words."""

from __future__ import annotations

import html
import re
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from esp_trainer.analysis.inference import Estimate
from esp_trainer.cli import main
from esp_trainer.statistics import Rate, in_points

RUNS: dict[str, list[str]] = {
    "nothing is caught": ["--env.size", "60", "--env.max_cycles", "1", "--generations", "4"],
    "all is caught": ["--env.size", "4", "--env.n_predators", "8", "--env.n_prey", "1", "--generations", "4"],
    "one generation": ["--generations", "1"],
    "a script": ["--env.size", "60", "--env.max_cycles", "1", "--generations", "4", "--prey.policy", "random"],
}


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of each kind, and one with another seed in which nothing is caught."""
    place = tmp_path_factory.mktemp("runs")
    small = ["--esp.subpopulation_size", "8", "--esp.hof_mates", "1", "--esp.n_trials", "16", "--quiet"]
    for name, options in {**RUNS, "another": [*RUNS["nothing is caught"], "--seed", "1"]}.items():
        assert main(["train", "smoke", "--out", str(place / name), *small, *options]) == 0
    return place


def assert_in_words(text: str) -> None:
    assert "nan" not in re.split(r"[^a-z]+", text)
    assert not re.search(r"(?<!\w)-0(\.0+)?(?![.\d])", text), text
    assert not re.search(r"(?<![\d.-])1 (episode|generation|opponent|phase|predator|run|seed|step)s\b", text), text


@pytest.mark.parametrize("few", [["--episodes", "1"], ["--episodes", "1", "--generations", "1"], ["--episodes", "8"]])
@pytest.mark.parametrize("command", ["analyse", "behaviours", "report", "compare"])
@pytest.mark.parametrize("name", RUNS)
def test_it_is_told_without_a_number_that_is_none(
    name: str, command: str, few: list[str], esp_trainer: Callable[..., Any], place: Path
) -> None:
    out = ["--out", "page.html"] if command in ("report", "compare") else []
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        outcome = esp_trainer(command, place / name, *few, *out)
    if command in ("analyse", "compare") and (name == "one generation" or "--generations" in few):
        assert outcome.refusal.startswith("esp-trainer: progress takes at least 3 generations, got 1")
        return
    assert outcome.code == 0
    assert_in_words(outcome.out + outcome.err)
    if command == "report":
        page = Path("page.html").read_text("utf-8")
        assert_in_words(html.unescape(page[page.index("<ol>") : page.index("</section>")]))


def test_where_nothing_is_caught_nothing_is_divided(esp_trainer: Callable[..., Any], place: Path) -> None:
    lines = esp_trainer("analyse", place / "nothing is caught", "--episodes", "8").out.splitlines()
    assert "  who beats whom         no differences beyond chance" in lines
    assert (
        "  as a game              value 0.00; optimal play mixes generations: 1 of the predators, 1 of the prey"
        in lines
    )
    assert lines[-2].endswith("exploitability within the run: predators 0.00, prey 0.00")


def test_one_episode_a_pair_says_nothing_of_chance(esp_trainer: Callable[..., Any], place: Path) -> None:
    lines = esp_trainer("analyse", place / "all is caught", "--episodes", "1").out.splitlines()
    assert "  who beats whom         not known from one episode a pair" in lines


def test_several_runs_in_which_nothing_happens_have_a_page(esp_trainer: Callable[..., Any], place: Path) -> None:
    runs = place / "nothing is caught", place / "another"
    assert esp_trainer("report", *runs, "--episodes", "1", "--out", "page.html").code == 0


def test_what_chance_does_in_too_few_episodes_is_not_known(esp_trainer: Callable[..., Any], place: Path) -> None:
    lines = esp_trainer("behaviours", place / "one generation", "--episodes", "1").out.splitlines()
    assert (
        "- is not known: no episode can show the behaviour, or too few can be used to estimate the rate by chance"
        in lines
    )
    many = esp_trainer("behaviours", place / "one generation", "--episodes", "64").out
    assert ("- is not known" in many) == ("       -" in many)
    rows = {line[:22].strip(): line[22:].strip() for line in lines[2:-1]}
    assert rows["attacker"] == rows["herding"] == "-"
    assert rows["idling"] != "-"


def test_a_number_that_rounds_to_zero_has_no_sign() -> None:
    assert in_points(Rate(-0.2, -3.4, 0.4)) == "0 [-3, 0]"
    assert str(Estimate(-0.0001, -0.0004, 0.0002, 5)) == "0.000 [0.000, 0.000]"


def test_a_benchmark_is_refused_at_once_if_it_cannot_be_kept(esp_trainer: Callable[..., Any], tmp_path: Path) -> None:
    asked = ["benchmark", "--policy", "random", "--role", "prey", "--task", "3v1"]
    (tmp_path / "out" / "results.json").mkdir(parents=True)
    assert esp_trainer(*asked, "--out", "out").refusal == "esp-trainer: out/results.json: Is a directory"
    refusal = esp_trainer(*asked, "--leaderboard", "nowhere/board.md").refusal
    assert refusal == "esp-trainer: nowhere/board.md: No such file or directory"


def test_a_video_is_refused_before_anything_is_played(esp_trainer: Callable[..., Any]) -> None:
    refusal = esp_trainer("replay", "nobody", "--against", "nobody", "--gif", "nowhere/a.gif").refusal
    assert refusal == "esp-trainer: nowhere/a.gif: No such file or directory"
