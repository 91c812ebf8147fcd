"""``solve`` and ``exploitability`` on the terminal, and ``replay`` of optimal play."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from esp_trainer.cli import exact, main
from esp_trainer.exact.solution import Solution
from esp_trainer.teams.zoo import load_team
from predprey_env import EnvConfig


def test_a_script_that_can_be_foreseen_never_catches_a_prey_that_foresees_it(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["exploitability", "greedy_chase", "--role", "predators", "--size", "5", "--steps", "6"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "greedy_chase, predators on a torus of 5 x 5, 3 v 1, 6 steps: the fraction of prey caught"
    optimal, exploited = (line.split()[-5:] for line in lines[2:4])
    assert all(0.9 < float(value) < 1 for value in optimal)
    assert exploited == ["0.000"] * 5
    assert lines[4] == f"exploitability: {float(optimal[0]):.3f} of the prey"


def test_a_policy_of_ones_own_is_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "eastward.py").write_text("def go_east(observations):\n    return dict.fromkeys(observations, 0)\n")
    monkeypatch.chdir(tmp_path)
    assert main(["exploitability", "eastward:go_east", "--role", "prey", "--size", "4", "--steps", "5"]) == 0
    assert capsys.readouterr().out.splitlines()[3].split()[-5:] == ["1.000"] * 5


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["run_straight", "--role", "prey"], "run_straight has memory, so that its actions do not follow from"),
        (["greedy_chase", "--role", "predators", "--size", "60"], "not enough memory: "),
        (["greedy_chase", "--role", "prey"], "expected prey, got greedy_chase, a script of predators"),
        (["greedy_chase", "--role", "predators", "--size", "2"], "size must be at least 3, got 2"),
        (["random", "--role", "prey", "--prey", "40", "--size", "9"], "not enough memory: "),
        (
            ["random", "--role", "prey", "--prey", "300", "--size", "20"],
            "not enough memory: more than 1,000,000,000 GB",
        ),
    ],
)
def test_what_cannot_be_measured_is_said_in_one_line(
    arguments: list[str], says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["exploitability", *arguments]) == 1
    assert capsys.readouterr().err.splitlines()[-1].startswith(f"esp-trainer: {says}")


def test_two_prey_that_draw_are_measured_by_one_predator(capsys: pytest.CaptureFixture[str]) -> None:
    teams = ["--predators", "1", "--prey", "2", "--size", "4", "--steps", "4"]
    assert main(["exploitability", "random", "--role", "prey", *teams]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "random, prey on a torus of 4 x 4, 1 v 2, 4 steps: the fraction of prey caught"
    assert lines[1].split()[-4:] == ["all", "0", "1", "2"]
    optimal, exploited = (float(line.split()[-4]) for line in lines[2:4])
    assert optimal < 0.05
    assert 0.5 < exploited < 1


def test_a_game_is_solved_told_and_saved(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "game"
    assert main(["solve", "--size", "6", "--steps", "5", "--out", str(file)]) == 0
    told = capsys.readouterr()
    lines = told.out.splitlines()
    assert lines[0] == "a torus of 6 x 6, 3 v 1, 5 steps, both sides playing optimally: the fraction of prey caught"
    assert [line.split()[0] for line in lines[3:8]] == ["1", "2", "3", "4", "5"]
    assert lines[7].split() == ["5", "0.798", "0.704", "0.777", "0.830", "0.872"]
    assert lines[8] == f"the solved game is in {file}: 0.1 MB"
    assert told.err.splitlines() == [
        "some 1 MB of memory are needed",
        "estimated time: 1 s on an idle machine",
    ]
    assert Solution.load(file).horizon == 5


@pytest.mark.parametrize(
    ("seconds", "says"),
    [(0.01, "1 s"), (119, "119 s"), (121, "2 minutes"), (7300, "2 hours"), (86400 * 1500, "1,500 days")],
)
def test_how_long_it_takes_is_told_before_it_starts(
    seconds: float, says: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(exact, "seconds_to_solve", lambda *_: seconds)
    monkeypatch.setattr(exact, "seconds_to_answer", lambda *_: 0.0)
    monkeypatch.setattr(exact, "solve_game", stop)
    for arguments in (["solve"], ["exploitability", "random", "--role", "prey"]):
        assert main([*arguments, "--size", "4"]) == 130
        told = capsys.readouterr()
        assert told.out == ""
        assert f"estimated time: {says} on an idle machine" in told.err.splitlines()


def test_the_time_that_a_policy_takes_is_told_before_it_is_asked_everywhere(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(exact, "sample_of", lambda *_: (np.full((1, 1, 4), 0.25), 7200.0))
    monkeypatch.setattr(exact, "chances", stop)
    assert main(["exploitability", "random", "--role", "prey", "--size", "4"]) == 130
    assert capsys.readouterr().err.splitlines()[1:] == [
        "estimated time: 2 hours on an idle machine",
        "asking the policy in 4,096 positions ...",
        "esp-trainer: interrupted",
    ]


@pytest.mark.parametrize("role", ["predators", "prey"])
def test_a_team_of_another_world_is_said_to_be_one(
    role: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    team = load_team(f"modern-3v1/{role}/seed-500-late")
    file = tmp_path / "team.safetensors"
    asked = ["exploitability", str(file), "--role", role, "--size", "4", "--steps", "3"]
    team.save(file)
    assert main(asked) == 0
    assert capsys.readouterr().err.splitlines()[0] == (
        f"note: {file} evolved with size=100, max_cycles=150; here size=4, max_cycles=3"
    )
    here = EnvConfig(size=4, n_prey=1, max_cycles=3, reward="dense").model_dump()
    for provenance in ({}, {"env": here}):
        replace(team, provenance=provenance).save(file)
        assert main(asked) == 0
        assert "note: " not in capsys.readouterr().err
    replace(team, provenance={"env": "nowhere"}).save(file)
    assert main(asked) == 1
    assert capsys.readouterr().err == (
        f"esp-trainer: {file} does not say which world it is for: EnvConfig must be a mapping of fields, "
        "got 'nowhere': save the team with provenance "
        '{"env": EnvConfig(...).model_dump()}\n'
    )


def test_fields_of_the_world_are_those_that_were_asked_for(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "game"
    assert (
        main(["solve", "--size", "4", "--prey", "2", "--predators", "2", "--in-turns", "--no-idle", "--out", str(file)])
        == 0
    )
    assert "4 x 4, 2 v 2, 6 steps, predators may not idle, the prey move first, both" in capsys.readouterr().out
    config = Solution.load(file).config
    assert (config.n_prey, config.n_predators, config.predator_idle, config.move_order) == (2, 2, False, "prey_first")


def test_nothing_is_solved_whose_outcome_cannot_be_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["solve", "--size", "6", "--out", str(tmp_path / "no" / "game")]) == 1
    assert capsys.readouterr() == ("", f"esp-trainer: {tmp_path / 'no' / 'game'}: No such file or directory\n")


@pytest.fixture
def game(tmp_path: Path) -> str:
    file = tmp_path / "game"
    main(["solve", "--size", "6", "--out", str(file)])
    return f"optimal:{file}"


def test_optimal_play_is_shown(game: str, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    for pair in ((game, "flee_nearest"), ("flee_nearest", game), (game, game), (game, "greedy_chase")):
        assert main(["replay", pair[0], "--against", pair[1]]) == 0
        shown = capsys.readouterr().out
        assert "caught 1/1" in shown or "step 9/9" in shown
    assert main(["replay", game, "--against", "modern-3v1/prey/seed-500-late"]) == 0
    assert f"they play in that of {game}" in capsys.readouterr().err


def test_optimal_play_in_turns_always_catches(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "game"
    main(["solve", "--size", "4", "--prey", "2", "--steps", "12", "--in-turns", "--out", str(file)])
    for seed in range(5):
        capsys.readouterr()
        assert main(["replay", f"optimal:{file}", "--against", f"optimal:{file}", "--seed", str(seed)]) == 0
        assert "caught 2/2" in capsys.readouterr().out


def test_optimal_play_is_refused_where_it_is_not_known(game: str, capsys: pytest.CaptureFixture[str]) -> None:
    for arguments, says in (
        (["replay", "modern-3v1/prey/seed-500-late", "--against", game], "optimal play is known for n_prey=1, size=6,"),
        (["evaluate", game, "--against", "flee_nearest"], "optimal play is not evaluated but solved: "),
        (["exploitability", game, "--role", "prey"], "optimal play changes with the steps left, and is only for "),
        (["replay", "optimal:nothing", "--against", "flee_nearest"], "nothing is not there"),
    ):
        assert main(arguments) == 1
        assert capsys.readouterr().err.startswith(f"esp-trainer: {says}")
