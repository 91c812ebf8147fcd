"""``evaluate``, ``show`` and ``replay``: teams on the terminal."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from esp_trainer.cli import replay, teams
from esp_trainer.coevolution.sides import side_config, side_controller
from esp_trainer.esp.team import Team
from esp_trainer.evaluation.match import match
from esp_trainer.presets import preset
from esp_trainer.statistics import wilson
from esp_trainer.types import ROLES, ScriptedTeams
from predprey_env import EnvConfig

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

_INTERVAL = r"(\d\.\d{3}) \[(\d\.\d{3}), (\d\.\d{3})\]"


def _rates(output: str) -> dict[str, tuple[float, ...]]:
    """Every line that ends in a rate and its interval, by what stands before it."""
    found = re.findall(rf"^  *(.*?)  +{_INTERVAL}$", output, re.MULTILINE)
    return {name: tuple(map(float, numbers)) for name, *numbers in found}


def test_evaluate_prints_every_rate_with_its_interval(
    esp_trainer: Callable[..., Any], predators: Path, prey: Path
) -> None:
    outcome = esp_trainer("evaluate", predators, "--against", prey)
    assert outcome.code == 0
    assert outcome.err == ""
    assert outcome.out.startswith("1000 episodes from held-out starts (seed 0), 95% Wilson intervals\n")
    rates = _rates(outcome.out)
    assert list(rates) == ["prey caught", "all prey caught", "no prey caught", "0", "1", "2", "3"]
    assert all(low < rate < high for rate, low, high in rates.values())
    rate, low, high = rates["all prey caught"]
    expected = wilson(round(1000 * rate), 1000)
    assert (low, high) == (pytest.approx(expected.low, abs=6e-4), pytest.approx(expected.high, abs=6e-4))


def test_evaluate_prints_what_the_match_found(esp_trainer: Callable[..., Any], predators: Path, prey: Path) -> None:
    outcome = esp_trainer("evaluate", predators, "--against", prey, "--episodes", "300", "--seed", "7")
    found = match(Team.load(predators), Team.load(prey), preset("smoke").env, 300, 7)
    rates = {name: numbers[0] for name, numbers in _rates(outcome.out).items()}
    by_even = {str(n): rate.rate for n, rate in enumerate(found.caught_by_even) if rate}
    expected = {
        "prey caught": found.caught.rate,
        "all prey caught": found.predators_succeed.rate,
        "no prey caught": found.prey_succeed.rate,
        **by_even,
    }
    assert rates == pytest.approx(expected, abs=6e-4)
    assert "300 episodes from held-out starts (seed 7)" in outcome.out
    assert f"{found.steps:.1f} of 30 steps" in outcome.out
    assert f"predators {found.predator_fitness:.2f}, prey {found.prey_fitness:.2f}" in outcome.out


def test_evaluate_takes_the_teams_in_either_order(esp_trainer: Callable[..., Any], predators: Path, prey: Path) -> None:
    one = esp_trainer("evaluate", predators, "--against", prey, "--episodes", "50")
    other = esp_trainer("evaluate", prey, "--against", predators, "--episodes", "50")
    assert one == other


def test_evaluate_says_where_no_start_has_so_many_even_predators(
    esp_trainer: Callable[..., Any], predators: Path, prey: Path
) -> None:
    outcome = esp_trainer("evaluate", predators, "--against", prey, "--episodes", "1")
    rows = outcome.out.splitlines()[-4:]
    assert [row.split()[0] for row in rows] == ["0", "1", "2", "3"]
    assert any(row.endswith("no such start") for row in rows)


def test_another_seed_is_another_sample(esp_trainer: Callable[..., Any], predators: Path, prey: Path) -> None:
    samples = {esp_trainer("evaluate", predators, "--against", prey, "--seed", seed).out for seed in (0, 0, 1)}
    assert len(samples) == 2


@pytest.mark.parametrize("command", ["evaluate", "replay"])
def test_a_script_may_be_either_team(
    command: str, esp_trainer: Callable[..., Any], predators: Path, prey: Path
) -> None:
    assert esp_trainer(command, predators, "--against", "flee_nearest").code == 0
    assert esp_trainer(command, "flee_nearest", "--against", predators).code == 0
    assert esp_trainer(command, prey, "--against", "greedy_chase").code == 0
    assert esp_trainer(command, "greedy_chase", "--against", prey).code == 0


def test_a_script_plays_its_own_part(esp_trainer: Callable[..., Any], prey: Path) -> None:
    outcome = esp_trainer("evaluate", prey, "--against", "greedy_chase", "--episodes", "200")
    found = match(ScriptedTeams("greedy_chase"), Team.load(prey), preset("smoke").env, 200)
    assert _rates(outcome.out)["prey caught"][0] == pytest.approx(found.caught.rate, abs=6e-4)


def test_evaluate_says_when_the_teams_come_from_different_worlds(
    esp_trainer: Callable[..., Any], predators: Path, tmp_path: Path
) -> None:
    """Only one of the worlds is played in, so the reader must know which."""
    esp_trainer("train", "smoke", "--env.size", "20", "--env.max_cycles", "40", "--generations", "1", "--out", "other")
    outcome = esp_trainer("evaluate", predators, "--against", "other/champions/prey-00000.safetensors")
    said = outcome.out + outcome.err
    assert re.search(r"size|world", said), said


def test_show_says_what_a_team_is_and_where_it_came_from(esp_trainer: Callable[..., Any], predators: Path) -> None:
    outcome = esp_trainer("show", predators)
    assert outcome.code == 0
    assert outcome.err == ""
    team = Team.load(predators)
    lines = {line[2:14].strip(): line[14:] for line in outcome.out.splitlines()[1:]}
    assert outcome.out.splitlines()[0] == f"{predators}: 3 predators"
    assert lines["networks"] == "2 an agent (split), 2-10-5, logistic outputs"
    assert lines["genes"].startswith(f"{3 * 2 * 10 * (2 + 5)}, from -")
    assert lines["from"] == "smoke, seed 0, generation 19"
    assert "size=12" in lines["world"]
    assert lines["chosen by"] == f"reevaluate, mean fitness {team.provenance['score']:.2f}, the best of its contenders"
    caught = team.provenance["held_out"]["caught"]
    assert lines["held out"].startswith(f"{caught['rate']:.3f} [{caught['low']:.3f}, {caught['high']:.3f}]")


def _team_of_someone(provenance: dict[str, Any], template: Path) -> Team:
    team = Team.load(template)
    return Team(team.role, team.side, team.controller, team.genomes, provenance)


PROVENANCES: dict[str, dict[str, Any]] = {
    "none": {},
    "a generation alone": {"generation": 3},
    "a score alone": {"score": 3.5},
    "its own": {"author": "me"},
    "no rates": {"held_out": {}, "zoo": {}},
    "words for rates": {"held_out": {"caught": {"rate": "x", "low": 0, "high": 1}}, "zoo": "mine"},
    "sections that are none": {"preset": "paper-3v2", "predators": 3, "champion": 4, "score": 1.0},
    "sections with other fields": {"preset": "paper-3v2", "esp": {"x": 1}},
    "presets": {"preset": ["x"]},
    "a score in words": {"score": "x"},
}


@pytest.mark.parametrize("provenance", PROVENANCES.values(), ids=PROVENANCES)
def test_show_knows_teams_that_say_little_of_where_they_came_from(
    provenance: dict[str, Any], esp_trainer: Callable[..., Any], prey: Path
) -> None:
    """:class:`Team` is public: anyone may save one."""
    _team_of_someone(provenance, prey).save("mine.safetensors")
    outcome = esp_trainer("show", "mine.safetensors")
    assert (outcome.code, outcome.err) == (0, "")
    assert outcome.out.startswith("mine.safetensors: 2 prey\n")
    assert not re.search("held out|in the zoo|changed", outcome.out)


def test_a_team_without_a_world_plays_in_the_other_teams(
    esp_trainer: Callable[..., Any], predators: Path, prey: Path
) -> None:
    _team_of_someone({}, prey).save("mine.safetensors")
    outcome = esp_trainer("evaluate", predators, "--against", "mine.safetensors")
    assert (outcome.code, outcome.err) == (0, "")
    assert "size=12" in outcome.out


@pytest.mark.parametrize("command", ["evaluate", "replay"])
@pytest.mark.parametrize(("role", "script"), [("predators", "flee_nearest"), ("prey", "greedy_chase")])
def test_a_team_without_a_world_plays_a_script_in_the_papers(
    command: str, role: str, script: str, esp_trainer: Callable[..., Any], smoke_run: Path
) -> None:
    champion = smoke_run / f"champions/{role}-00019.safetensors"
    _team_of_someone({}, champion).save("mine.safetensors")
    _team_of_someone({"env": EnvConfig().model_dump()}, champion).save("told.safetensors")
    for pair in (("mine.safetensors", script), (script, "mine.safetensors")):
        outcome = esp_trainer(command, pair[0], "--against", pair[1])
        assert outcome.code == 0
        assert outcome.err == (
            "mine.safetensors does not say which world it is for: it plays in the paper's, 3 against 2 on 100 x 100 "
            'cells; for another, save it with provenance={"env": EnvConfig(...).model_dump()}\n'
        )
    told = esp_trainer(command, "told.safetensors", "--against", script)
    assert (told.code, told.err) == (0, "")
    assert told.out == outcome.out


def test_of_two_teams_without_a_world_the_predators_say_whether_they_may_idle(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = preset("paper-3v2").with_fields({"env.predator_idle": False})
    hunters, hunted = (str(tmp_path / f"{role}.safetensors") for role in ROLES)
    for role, file in zip(ROLES, (hunters, hunted), strict=True):
        controller, n_agents = side_controller(config, role), config.env.team(role).n_agents
        genomes = np.zeros((n_agents, *controller.shape), np.float32)
        Team(role, side_config(config, role), controller, genomes).save(file)
    for pair in ((hunters, hunted), (hunted, hunters)):
        players, env = teams.pair(*pair)
        assert list(players) == [Team.load(file).role for file in pair]
        assert not env.predator_idle
        assert capsys.readouterr().err.split(" ")[0] == hunters


def test_teams_without_a_world_that_do_not_fit_are_refused(
    esp_trainer: Callable[..., Any], predators: Path, three_prey_run: Path
) -> None:
    _team_of_someone({}, predators).save("mine.safetensors")
    _team_of_someone({}, three_prey_run / "champions/prey-00000.safetensors").save("other.safetensors")
    outcome = esp_trainer("evaluate", "mine.safetensors", "--against", "other.safetensors")
    assert outcome.code == 1
    assert outcome.err.splitlines()[1:] == ["esp-trainer: this world has 2 prey, got a team of 3"]


def test_where_a_team_came_from_must_be_json(prey: Path, tmp_path: Path) -> None:
    for wrong in (EnvConfig(), np.zeros(2), float("nan"), np.float32("nan")):
        with pytest.raises(ValueError, match=r"^provenance must hold JSON values, such as config\.model_dump\(\): "):
            _team_of_someone({"env": wrong}, prey).save("mine.safetensors")
    assert list(tmp_path.iterdir()) == []


def test_numpy_numbers_in_where_a_team_came_from_are_numbers(prey: Path) -> None:
    provenance = {"generation": np.int64(3), "by": {"score": [np.float32(0.5), np.array(2)], "best": np.bool_(True)}}
    _team_of_someone(provenance, prey).save("mine.safetensors")
    found = Team.load("mine.safetensors").provenance
    assert json.dumps(found) == '{"generation": 3, "by": {"score": [0.5, 2], "best": true}}'


def test_a_team_that_came_from_nowhere_is_saved(prey: Path) -> None:
    _team_of_someone(None, prey).save("mine.safetensors")  # type: ignore[arg-type]
    assert Team.load("mine.safetensors").provenance == {}


def test_replay_prints_a_frame_for_each_step(esp_trainer: Callable[..., Any], predators: Path, prey: Path) -> None:
    outcome = esp_trainer("replay", predators, "--against", prey)
    assert outcome.code == 0
    assert outcome.err == ""
    steps = [int(step) for step in re.findall(r"step (\d+)/30", outcome.out)]
    assert steps == list(range(len(steps)))
    caught = re.findall(r"caught (\d)/2", outcome.out)
    assert caught == sorted(caught)
    assert steps[-1] == 30 or caught[-1] == "2"
    assert "\x1b" not in outcome.out, "control sequences are for terminals"


def test_replay_is_the_same_for_the_same_seed(esp_trainer: Callable[..., Any], predators: Path, prey: Path) -> None:
    frames = [esp_trainer("replay", predators, "--against", prey, "--seed", seed).out for seed in (5, 5, 6)]
    assert frames[0] == frames[1] != frames[2]


@pytest.mark.parametrize("command", ["evaluate", "replay"])
def test_an_interrupt_ends_without_a_traceback(
    command: str, esp_trainer: Callable[..., Any], predators: Path, prey: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(*_: Any, **__: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(teams, "match", interrupt)
    monkeypatch.setattr(replay, "play_episode", interrupt)
    outcome = esp_trainer(command, predators, "--against", prey)
    assert outcome.code == 130
    assert len(outcome.err.splitlines()) <= 1


def test_a_champion_says_what_the_log_says(smoke_run: Path, predators: Path) -> None:
    last = json.loads((smoke_run / "metrics.jsonl").read_text().splitlines()[-1])
    team = Team.load(predators)
    assert team.provenance["held_out"] == last["held_out"]
    assert team.provenance["score"] == last["champions"]["predators"]
    assert np.isfinite(team.genomes).all()
