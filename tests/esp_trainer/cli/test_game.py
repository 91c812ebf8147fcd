"""Another game than the predator-prey world from the command line: trained, resumed, watched, measured, reported."""

from __future__ import annotations

import csv
import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from waiting import PATIENCE, wait

from esp_trainer.analysis import progress
from esp_trainer.analysis.best_response import evolve_response
from esp_trainer.analysis.cross_play import PayoffPlay, own_cross_play
from esp_trainer.analysis.history import History
from esp_trainer.cli import main
from esp_trainer.evaluation.other_game import GameEvaluator
from esp_trainer.statistics import mean_of

EXAMPLES = Path(__file__).parents[3] / "examples"
GAME = ["--game.environment", "own_game", "--game.predators", "chaser_", "--game.prey", "runner_"]
SMALL = ["--esp.n_trials", "12", "--esp.subpopulation_size", "8", "--champion.n_candidates", "2"]
SMALL += ["--champion.n_held_out", "6", "--checkpoint_every", "4", "--threads", "1", "--quiet"]


@pytest.fixture(scope="module", autouse=True)
def _examples() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(EXAMPLES))
        patch.setattr("esp_trainer.evaluation.other_game.cores", lambda: 1)  # starting processes takes long
        yield


def train(place: Path, *options: str) -> Path:
    assert main(["train", "game", *GAME, *SMALL, "--out", str(place), *options]) == 0
    return place


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Two runs of six generations. Not to be changed, but for their caches."""
    place = tmp_path_factory.mktemp("ring")
    return [train(place / f"seed{seed}", "--generations", "6", "--seed", str(seed)) for seed in (0, 1)]


def test_train_tells_payoffs(esp_trainer: Callable[..., Any]) -> None:
    outcome = esp_trainer("train", "game", *GAME, *SMALL, "--generations", "4")
    assert outcome.code == 0
    log = [json.loads(line) for line in Path("runs/game-seed0/metrics.jsonl").read_text().splitlines()]
    held_out = [line["held_out"] for line in log]
    mean = sum(each["payoff"]["rate"] for each in held_out) / 4
    paid = sum(each["predator_fitness"] for each in held_out) / 4
    results = f"payoff {mean:.2f} to the predators; a predator is paid {paid:.2f} an episode, a prey {-paid:.2f}"
    assert outcome.out.splitlines()[:2] == [
        "4 generations in runs/game-seed0",
        f"last 4 generations, champion against champion: {results}",
    ]
    assert f"generation 4/4: payoff {held_out[-1]['payoff']['rate']:.2f}" in outcome.err
    assert outcome.out.splitlines()[-2:] == [
        "  esp-trainer report runs/game-seed0",
        "  esp-trainer analyse runs/game-seed0",
    ]
    assert set(log[0]["trials"]["prey"]) == {"mean", "best", "payoff"}
    assert (
        log[0]["trials"]["predators"]["payoff"] == log[0]["trials"]["predators"]["mean"]
    )  # all chasers are paid alike
    assert held_out[0]["steps"] == 20


def test_a_run_that_is_resumed_ends_in_the_same_bytes(
    runs: list[Path], snapshot: Callable[[Path], dict[str, bytes]], tmp_path: Path, esp_trainer: Callable[..., Any]
) -> None:
    part = train(tmp_path / "part", "--generations", "4")
    assert esp_trainer("resume", part, "--generations", "6", "--threads", "1").code == 0
    whole = {name: content for name, content in snapshot(runs[0]).items() if not name.startswith("analysis")}
    assert snapshot(part) == whole


def test_watch_tells_payoffs(runs: list[Path], esp_trainer: Callable[..., Any]) -> None:
    outcome = esp_trainer("watch", runs[0])
    assert len(outcome.out.splitlines()) == 6
    assert outcome.out.splitlines()[-1].startswith("generation 6/6: payoff ")


def test_analyse_measures_payoffs(runs: list[Path], esp_trainer: Callable[..., Any], tmp_path: Path) -> None:
    outcome = esp_trainer("analyse", *runs, "--episodes", "8", "--figures", tmp_path)
    assert outcome.code == 0
    history = History.of_run(runs[0])
    own = own_cross_play(history, GameEvaluator(history.config.game, 1), n_episodes=8)
    assert isinstance(own, PayoffPlay)
    both, corners = progress.historical_progress(own.payoff, 0.0), progress.early_late(own.payoff, 0.0)
    lines = outcome.out.splitlines()
    assert lines[1] == "  6 x 6 generations, 8 episodes each; payoff to the predators:"
    assert lines[3].split()[2:] == [f"{corners.early_hunt_early:.2f}", f"{corners.early_hunt_late:.2f}"]
    gains = f"predators {both.predators.strength:+z.2f}, prey {both.prey.strength:+z.2f}"
    assert lines[5].startswith(f"  progress against the run's own opponents   {gains}; two-sided")
    assert lines[6].startswith("  progress against those of the other runs   predators ")
    with (tmp_path / "seed0-ciao.csv").open() as file:
        drawn = list(csv.DictReader(file))
    assert [float(row["payoff"]) for row in drawn] == pytest.approx(own.payoff.ravel().tolist(), rel=1e-5)


def test_the_cross_play_is_kept_and_read_again(runs: list[Path], tmp_path: Path) -> None:
    history, cache = History.of_run(runs[0]), tmp_path / "kept.safetensors"
    evaluator = GameEvaluator(history.config.game, 1)
    played = own_cross_play(history, evaluator, n_generations=3, n_episodes=4, cache=cache)
    again = own_cross_play(history, None, n_generations=3, n_episodes=4, cache=cache)  # type: ignore[arg-type]
    assert isinstance(played, PayoffPlay)
    assert isinstance(again, PayoffPlay)
    assert again.payoff.tobytes() == played.payoff.tobytes()
    assert again.predators.tolist() == [0, 2, 5]
    one = mean_of(played.payoff[0])
    assert one.low <= one.rate <= one.high
    assert repr(played) == "<PayoffPlay: 3 x 3 generations, 4 episodes each>"


@pytest.mark.parametrize("role", ["predators", "prey"])
def test_a_best_response_is_measured_in_payoffs(role: str, runs: list[Path]) -> None:
    history = History.of_run(runs[0])
    evaluator = GameEvaluator(history.config.game, 1)
    found = evolve_response(history, role, evaluator, n_generations=2, n_episodes=8, seed=7)
    assert len(found.curve) == 2
    assert 0 <= found.before <= 20
    assert found.gain == (found.after - found.before) * (1 if role == "predators" else -1)


def test_exploiters_are_chosen_by_payoffs(esp_trainer: Callable[..., Any]) -> None:
    exploit = ["--esp.exploiters_every", "2", "--esp.exploiter_generations", "2", "--generations", "2"]
    assert esp_trainer("train", "game", *GAME, *SMALL, *exploit).code == 0
    first, last = map(json.loads, Path("runs/game-seed0/metrics.jsonl").read_text().splitlines())
    assert "exploited" not in first
    assert all(0 <= payoff <= 20 for payoff in last["exploited"].values())
    assert set(last["exploited"]) == {"predators", "prey"}


def test_the_parents_of_neurons_can_be_kept(esp_trainer: Callable[..., Any]) -> None:
    assert esp_trainer("train", "game", *GAME, *SMALL, "--generations", "4", "--genealogy", "true").code == 0
    told = esp_trainer("analyse", "runs/game-seed0", "--episodes", "2")
    assert "  founders left          predators " in told.out


def test_report_is_a_page_of_payoffs_without_a_player(
    runs: list[Path], esp_trainer: Callable[..., Any], tmp_path: Path
) -> None:
    outcome = esp_trainer("report", *runs, "--episodes", "8", "--out", tmp_path / "page.html")
    assert outcome.code == 0
    page = (tmp_path / "page.html").read_text("utf-8")
    said = page[page.index('id="story"') : page.index('<section id="play"')]
    assert "payoff to the predators" in page
    assert not {"caught", "catch", "torus"} & set(said.replace(".", "").split())
    assert "2 chaser against 1 runner in own_game" in page
    data = json.loads(page.partition('<script type="application/json" id="data">')[2].partition("</script>")[0])
    assert (data["world"], data["starts"], data["moments"]) == (None, [], [])
    assert [run["sides"] for run in data["runs"]] == [None, None]
    assert data["matrix"]["words"] == "to the predators"
    assert {chart["id"] for chart in data["charts"]} >= {"success", "master", "others"}
    assert "behaviours" not in {chart["id"] for chart in data["charts"]}


def test_compare_measures_payoffs(runs: list[Path], esp_trainer: Callable[..., Any], tmp_path: Path) -> None:
    table = tmp_path / "measures.csv"
    outcome = esp_trainer("compare", *runs, "--episodes", "4", "--out", tmp_path / "page.html", "--csv", table)
    assert outcome.code == 0
    assert outcome.out.startswith("predators, payoff: mean over seeds [95% interval]\n")
    with table.open() as file:
        rows = list(csv.DictReader(file))
    assert [float(row["payoff"]) for row in rows] == pytest.approx(
        [History.of_run(run).payoff[-2:].mean() for run in runs], rel=1e-5
    )
    assert "caught" not in (tmp_path / "page.html").read_text("utf-8")


def test_runs_of_other_games_are_not_measured_together(
    runs: list[Path], esp_trainer: Callable[..., Any], tmp_path: Path
) -> None:
    other = train(tmp_path / "other", "--generations", "1", "--game.environment", "own_game:Ring")
    line = esp_trainer("compare", runs[0], "--panel", other).err.splitlines()[-1]
    assert line == (
        f"esp-trainer: runs must be of one game, so that their teams can meet, got own_game in {runs[0]} and "
        f"own_game:Ring in {other}"
    )


@pytest.mark.slow
def test_a_sweep_tells_payoffs(esp_trainer: Callable[..., Any], tmp_path: Path) -> None:
    fields = [f"{name[2:]} = {value!r}" for name, value in zip(GAME[::2], GAME[1::2], strict=True)]
    small = [f"{name[2:]} = {value}" for name, value in zip(SMALL[:-3:2], SMALL[1:-3:2], strict=True)]
    declared = ['preset = "game"', "[fields]", "generations = 2", *fields, *small]
    (tmp_path / "sweep.toml").write_text("\n".join(declared))
    shutil.copy(EXAMPLES / "own_game.py", tmp_path)
    outcome = esp_trainer("sweep", "sweep.toml", "--workers", "1", "--quiet")
    assert outcome.code == 0, outcome.err
    assert "payoff" in outcome.out.splitlines()[0]
    assert "payoff" in (tmp_path / "runs/sweep/runs.csv").read_text().splitlines()[0].split(",")


def test_commands_of_the_world_refuse_another_game(runs: list[Path], esp_trainer: Callable[..., Any]) -> None:
    predators, prey = (runs[0] / f"champions/{role}-00005.safetensors" for role in ("predators", "prey"))
    refused = "plays own_game: evaluate and replay are for the predator-prey world"
    assert esp_trainer("replay", predators, "--against", prey).refusal == f"esp-trainer: {predators} {refused}"
    assert esp_trainer("evaluate", predators, "--against", "flee_nearest").refusal.endswith(refused)
    assert esp_trainer("behaviours", runs[0]).refusal == (
        f"esp-trainer: behaviours is for the predator-prey world, got {runs[0]}, which plays own_game"
    )
    for command in (["benchmark", "--policy"], ["exploitability"]):
        options = ["--role", "predators", *(["--task", "3v1"] if command[0] == "benchmark" else [])]
        line = esp_trainer(*command, predators, *options).refusal
        assert line.endswith("this command is for the predator-prey world, got a team that plays own_game"), line
    shown = esp_trainer("show", predators)
    assert "  world       own_game" in shown.out.splitlines()


def test_a_cluster_does_not_play_another_game(esp_trainer: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    from contextlib import nullcontext

    monkeypatch.setattr("esp_trainer.cli.training.connected", lambda _: nullcontext())
    outcome = esp_trainer("train", "game", *GAME, *SMALL, "--address", "here")
    assert outcome.err.splitlines()[-1] == "esp-trainer: --address plays the predator-prey world alone, got own_game"
    assert not Path("runs/game-seed0").exists()


_COMMAND = [sys.executable, "-m", "esp_trainer", "train", "game", *GAME, *SMALL, "--threads", "2"]


def _lines(run: Path) -> int:
    log = run / "metrics.jsonl"
    return len(log.read_bytes().splitlines()) if log.exists() else 0


def _wait_for_lines(run: Path, process: subprocess.Popen[str], n: int) -> None:
    wait(lambda: process.poll() is not None or _lines(run) >= n, pause=0.05)
    assert process.poll() is None, process.communicate()


def _started(run: Path, *options: str) -> subprocess.Popen[str]:
    """Start a run in a process of its own, and wait until it has three generations."""
    place = os.environ | {"PYTHONPATH": os.pathsep.join([str(EXAMPLES.parent), str(EXAMPLES)])}
    command = [*_COMMAND, "--out", str(run), *options]
    process = subprocess.Popen(command, env=place, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    _wait_for_lines(run, process, 3)
    return process


def _workers(process: subprocess.Popen[str]) -> list[int]:
    """The processes that play for another one; the tracker of resources is none."""
    place = Path(f"/proc/{process.pid}/task/{process.pid}/children")
    children = map(int, place.read_text().split())
    return [child for child in children if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes()]


def _ended(pid: int) -> bool:
    """Return whether a process is gone, or a zombie that nobody has waited for."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except FileNotFoundError:
        return True


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="it looks for processes as Linux lists them")
def test_a_killed_run_ends_its_workers_and_goes_on_to_the_same_bytes(
    tmp_path: Path, snapshot: Callable[[Path], dict[str, bytes]], esp_trainer: Callable[..., Any]
) -> None:
    whole, run = train(tmp_path / "whole", "--generations", "40"), tmp_path / "killed"
    process = _started(run, "--generations", "40")
    workers = _workers(process)
    assert len(workers) == 2
    process.kill()
    process.communicate()
    wait(lambda: all(map(_ended, workers)))
    assert _lines(run) < 40
    assert esp_trainer("resume", run, "--threads", "1").code == 0
    assert snapshot(run) == snapshot(whole)


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="it looks for processes as Linux lists them")
def test_a_run_outlives_its_workers_and_stops_when_it_is_asked_to(
    tmp_path: Path, snapshot: Callable[[Path], dict[str, bytes]]
) -> None:
    run = tmp_path / "run"
    process = _started(run, "--generations", "5000")
    first, _ = workers = _workers(process)
    os.kill(first, signal.SIGKILL)
    _wait_for_lines(run, process, _lines(run) + 2)
    assert set(_workers(process)) != set(workers)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    done = _lines(run)
    assert said.splitlines()[-1] == f"stopped after {done} generations; go on with: esp-trainer resume {run}"
    whole = train(tmp_path / "whole", "--generations", str(done))
    ours, theirs = snapshot(run), snapshot(whole)
    assert ours["metrics.jsonl"] == theirs["metrics.jsonl"]
    assert {name for name in ours if ours[name] != theirs[name]} <= {"config.json", "checkpoint.safetensors"}
