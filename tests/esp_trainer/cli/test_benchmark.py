"""The commands ``teams`` and ``benchmark``, and zoo teams in the commands that take a team."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from esp_trainer.cli import main
from esp_trainer.teams.zoo import Zoo, known_teams, load_zoo

if TYPE_CHECKING:
    from collections.abc import Callable

PREDATORS, PREY = (
    next(name for name, t in known_teams().items() if (t.task, t.role) == ("3v1", role))
    for role in ("predators", "prey")
)
MODULE = """
import numpy as np

class East:
    meetings = 0

    def reset(self, seed=None): East.meetings += 1

    def act(self, observations): return dict.fromkeys(observations, 0)

    def act_batch(self, observations):
        if East.meetings > 2 and type(self).error is not None:
            raise type(self).error
        return np.zeros(observations.shape[:2], int)

    error = None

class Fails(East):
    error = RuntimeError("out of luck")

class Interrupted(East):
    error = KeyboardInterrupt()
"""
QUICK = ("--role", "prey", "--task", "3v1", "--episodes", "16")


def _few_of(zoo: Zoo) -> Zoo:
    """Every eleventh team, which has some of each part, and all scripts."""
    rows, columns = (
        [i for i, name in enumerate(zoo.names(role)) if i % 11 == 0 or "/" not in name]
        for role in ("predators", "prey")
    )
    return replace(
        zoo,
        predators=tuple(zoo.predators[i] for i in rows),
        prey=tuple(zoo.prey[i] for i in columns),
        captured=zoo.captured[np.ix_(rows, columns)],
    )


@pytest.fixture(scope="module", autouse=True)
def few() -> Iterator[Zoo]:
    """A gauntlet of a few opponents for the command, as the whole zoo takes seconds each time."""
    found = _few_of(load_zoo("3v1"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("esp_trainer.cli.benchmark.load_zoo", {"3v1": found}.__getitem__)
        yield found


@pytest.fixture(autouse=True)
def _policies(_somewhere_else: None, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A module of policies in the current directory."""
    monkeypatch.setattr(sys, "path", sys.path[:])
    Path("quick_policies.py").write_text(MODULE)
    yield
    for name in ("quick_policies", "repeats"):
        sys.modules.pop(name, None)


def test_teams_are_listed_best_first(esp_trainer: Callable[..., Any]) -> None:
    lines = esp_trainer("teams", "--task", "3v1").out.splitlines()
    listed = [line.split()[0] for line in lines if "/seed-" in line]
    teams = [team for team in known_teams().values() if team.task == "3v1"]
    assert sorted(listed) == sorted(team.name for team in teams)
    for role in ("predators", "prey"):
        ratings = [known_teams()[name].rating.rate for name in listed if f"/{role}/" in name]
        assert ratings == sorted(ratings, reverse=True)
    assert "held-out teams are for reporting only" in lines[-1]


def test_without_a_task_all_teams_are_listed(esp_trainer: Callable[..., Any]) -> None:
    assert esp_trainer("teams").out.count("/seed-") == len(known_teams())


@pytest.mark.parametrize("spec", ["flee_nearest", PREY, "quick_policies:East"])
def test_a_benchmark_is_printed_and_kept_the_same_each_time(
    spec: str, few: Zoo, esp_trainer: Callable[..., Any], contents: Callable[[Path], Any]
) -> None:
    first = esp_trainer("benchmark", "--policy", spec, *QUICK, "--out", "1st", "--name", "mine")
    second = esp_trainer("benchmark", "--policy", spec, *QUICK, "--out", "2nd", "--name", "mine")
    assert first.code == second.code == 0, first.err
    assert first.out.replace("1st", "2nd") == second.out
    assert list(contents(Path("1st")).values()) == list(contents(Path("2nd")).values())
    told = json.loads(Path("1st/results.json").read_text())
    assert told["complete"]
    assert sorted(row["opponent"] for row in told["rows"]) == sorted(few.predators)
    assert first.out.startswith("mine: prey of 3v1, 16 episodes each from held-out starts (seed 0)\n")
    assert all(row["opponent"] in first.out for row in told["rows"])
    assert ("caution: quick_policies was imported" in first.err) == (spec == "quick_policies:East")


@pytest.mark.slow
def test_everybody_of_the_zoo_and_every_script_is_met(
    esp_trainer: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("esp_trainer.cli.benchmark.load_zoo", load_zoo)
    outcome = esp_trainer("benchmark", "--policy", PREY, *QUICK, "--out", "whole")
    assert outcome.code == 0, outcome.err
    told = json.loads(Path("whole/results.json").read_text())
    assert sorted(row["opponent"] for row in told["rows"]) == sorted(load_zoo("3v1").predators)


@pytest.fixture(scope="module")
def rows_of_script(few: Zoo, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """What the script ``flee_nearest`` comes to against each opponent."""
    place = tmp_path_factory.mktemp("benchmark") / "script"
    assert main(["benchmark", "--policy", "flee_nearest", *QUICK, "--seed", "0", "--out", str(place)]) == 0
    return json.loads((place / "results.json").read_text())["rows"]


def test_an_own_policy_does_as_the_script_that_it_repeats(rows_of_script: Any, esp_trainer: Callable[..., Any]) -> None:
    Path("repeats.py").write_text(
        "from predprey_env.policies import ScriptedTeam\n"
        "class Flees:\n"
        "    def __init__(self): self.script = ScriptedTeam('flee_nearest')\n"
        "    def reset(self, seed=None): self.script.reset(seed)\n"
        "    def act(self, observations): return self.script.act(observations)\n"
    )
    esp_trainer("benchmark", "--policy", "repeats:Flees", *QUICK, "--out", "own")
    rows = [json.loads(Path("own/results.json").read_text())["rows"], rows_of_script]
    alike = [a for a, b in zip(*rows, strict=True) if a == b]
    others = {a["opponent"] for a, b in zip(*rows, strict=True) if a != b}
    assert len(alike) > len(others)
    assert all(name == "random" or "drawn" in name for name in others), "only what is random may differ"


def test_results_go_to_a_place_of_their_own(esp_trainer: Callable[..., Any]) -> None:
    assert esp_trainer("benchmark", "--policy", "flee_nearest", *QUICK, "--name", "a b/../c").code == 0
    assert [path.name for path in Path("benchmarks").iterdir()] == ["a-b-..-c-prey-3v1"]


def test_a_result_goes_on_a_leaderboard(esp_trainer: Callable[..., Any]) -> None:
    for script in ("flee_nearest", "run_straight"):
        outcome = esp_trainer("benchmark", "--policy", script, *QUICK, "--leaderboard", "board.md")
        assert outcome.out.endswith("on the leaderboard: board.md\n")
    board = Path("board.md").read_text()
    assert board.count("## 3v1, prey") == 1
    assert board.index("| flee_nearest |") < board.index("| run_straight |")


def test_a_file_that_is_no_leaderboard_is_refused_before_anything_is_played(esp_trainer: Callable[..., Any]) -> None:
    outcome = esp_trainer("benchmark", "--policy", "flee_nearest", *QUICK, "--leaderboard", "quick_policies.py")
    assert outcome.refusal.startswith("esp-trainer: quick_policies.py is not a leaderboard")
    assert not Path("benchmarks").exists()
    assert Path("quick_policies.py").read_text() == MODULE


@pytest.mark.parametrize(
    ("policy", "code", "line"),
    [
        ("Fails", 1, "esp-trainer: the policy's act_batch() raised RuntimeError: out of luck"),
        ("Interrupted", 130, "esp-trainer: interrupted"),
    ],
)
def test_a_way_that_ends_early_is_kept_as_far_as_it_went(
    policy: str, code: int, line: str, few: Zoo, esp_trainer: Callable[..., Any]
) -> None:
    outcome = esp_trainer("benchmark", "--policy", f"quick_policies:{policy}", *QUICK, "--out", "kept")
    assert outcome.code == code
    assert outcome.out == ""
    total = len(few.predators)
    assert outcome.err.splitlines()[1:] == [f"2 of {total} opponents met; the table so far is in kept", line]
    told = json.loads(Path("kept/results.json").read_text())
    assert (told["complete"], len(told["rows"])) == (False, 2)
    assert "the candidate did not finish" in Path("kept/table.txt").read_text()


BAD = {
    "unknown policy nobody; nothing is named like it": ("--policy", "nobody", *QUICK),
    "expected prey, got intercept, a script of predators": ("--policy", "intercept", *QUICK),
    "expected prey, got a team of predators": ("--policy", PREDATORS, *QUICK),
    "argument --task: invalid choice: '1v1'; did you mean 3v1?": (
        "--policy",
        "x",
        "--role",
        "prey",
        "--task",
        "1v1",
    ),
    "argument --role: invalid choice: 'wolves' (choose from predators, prey)": (
        "--policy",
        "x",
        "--role",
        "wolves",
    ),
    "argument --episodes: must be a whole number of at least 1, got '0'": ("--policy", "x", *QUICK[:-1], "0"),
    "the following arguments are required: --policy, --role, --task": (),
}


@pytest.mark.parametrize("line", BAD)
def test_a_mistake_is_told_in_one_line(line: str, esp_trainer: Callable[..., Any]) -> None:
    refusal = esp_trainer("benchmark", *BAD[line]).refusal
    assert refusal.removeprefix("esp-trainer benchmark: ").removeprefix("esp-trainer: ") == line
    assert not Path("benchmarks").exists()


def test_teams_of_the_zoo_are_shown_evaluated_and_replayed(esp_trainer: Callable[..., Any]) -> None:
    known = known_teams()[PREDATORS]
    shown = esp_trainer("show", PREDATORS).out
    assert shown.startswith(f"{PREDATORS}: 3 predators\n")
    assert f"{known.score} of the prey caught" in shown
    assert f"seed {known.seed}, generation {known.generation}" in shown
    evaluated = esp_trainer("evaluate", PREDATORS, "--against", PREY, "--episodes", 16)
    assert evaluated.out.startswith("16 episodes from held-out starts")
    assert esp_trainer("replay", PREY, "--against", "greedy_chase").out.count("step") > 5


def test_a_misspelt_team_of_the_zoo_gets_the_nearest(esp_trainer: Callable[..., Any]) -> None:
    assert esp_trainer("show", f"{PREY}r").refusal == f"esp-trainer: {PREY}r is not there; did you mean {PREY}?"


@pytest.mark.parametrize(
    ("option", "line"),
    [
        (("--drawn",), "esp-trainer: only policies of sb3: and torch: can be drawn, got flee_nearest: "),
        (("--seed", "-1"), "esp-trainer benchmark: argument --seed: "),
        (("--out", "quick_policies.py"), "esp-trainer: quick_policies.py: "),
    ],
)
def test_an_option_that_cannot_be_met_is_told_in_one_line(
    option: tuple[str, ...], line: str, esp_trainer: Callable[..., Any]
) -> None:
    assert esp_trainer("benchmark", "--policy", "flee_nearest", *QUICK, *option).refusal.startswith(line)
    assert Path("quick_policies.py").read_text() == MODULE


def test_two_teams_of_one_role_do_not_play_each_other(esp_trainer: Callable[..., Any]) -> None:
    for command in ("evaluate", "replay"):
        refusal = esp_trainer(command, PREY, "--against", PREY).refusal
        assert refusal == "esp-trainer: a match needs predators and prey, got two teams of prey"


def test_another_seed_gives_another_table(rows_of_script: Any, esp_trainer: Callable[..., Any]) -> None:
    assert esp_trainer("benchmark", "--policy", "flee_nearest", *QUICK, "--seed", "1", "--out", "other").code == 0
    assert json.loads(Path("other/results.json").read_text())["rows"] != rows_of_script
