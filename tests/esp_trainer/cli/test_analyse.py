"""``esp-trainer analyse``: the figures that it prints are those of the analysis, and what is wrong is one line."""

from __future__ import annotations

import csv
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
import pytest

from esp_trainer.analysis import games, phases, progress
from esp_trainer.analysis.cross_play import CrossPlay, cross_play, own_cross_play
from esp_trainer.analysis.genealogy import of_run
from esp_trainer.analysis.history import History
from esp_trainer.cli import main
from esp_trainer.evaluation.fused import FusedEvaluator

N = 22  # enough for phases
EPISODES = "16"


def _train(path: Path, *options: str, generations: int = N) -> Path:
    assert main(["train", "smoke", "--out", str(path), "--quiet", "--generations", str(generations), *options]) == 0
    return path


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Runs of two seeds, one against a script, and some that do not belong with them."""
    place = tmp_path_factory.mktemp("runs")
    _train(place / "first")
    _train(place / "second", "--seed", "1")
    _train(place / "fleeing", "--prey.policy", "flee_nearest")
    _train(place / "short", generations=3)
    _train(place / "elsewhere", "--env.size", "14", generations=3)
    _train(place / "other trials", "--esp.n_trials", "90", "--seed", "1", generations=3)
    return place


def own_of(run: Path, n_generations: int = 46) -> tuple[History, CrossPlay]:
    history = History.of_run(run)
    evaluator = FusedEvaluator(history.config.env, threads=1)
    return history, own_cross_play(history, evaluator, n_generations=n_generations, n_episodes=int(EPISODES))


def said(out: str) -> list[list[str]]:
    """Lines as words."""
    return [line.split() for line in out.splitlines()]


def signed(both: Any) -> str:
    two = progress.two_sided(both)
    return f"predators {both[0].strength:+.2f}, prey {both[1].strength:+.2f}; two-sided {two:+.2f}"


def line_of(out: str, beginning: str) -> str:
    (line,) = (line.strip() for line in out.splitlines() if line.strip().startswith(beginning))
    return line.removeprefix(beginning).strip()


def test_a_run_is_told_by_the_numbers_of_its_analysis(esp_trainer: Callable[..., Any], place: Path) -> None:
    outcome = esp_trainer("analyse", place / "first", "--episodes", EPISODES)
    assert outcome.code == 0
    history, own = own_of(place / "first")
    caught, corners = own.caught, progress.early_late(own.caught)
    assert outcome.out.splitlines()[0] == f"{place / 'first'}: smoke, seed 0, {N} generations"
    assert said(outcome.out)[1][:3] == [f"{N}", "x", f"{N}"]
    assert said(outcome.out)[1][4] == EPISODES
    assert (
        line_of(outcome.out, "early predators")
        == f"{corners.early_hunt_early:.2f}        {corners.early_hunt_late:.2f}"
    )
    assert (
        line_of(outcome.out, "late predators") == f"{corners.late_hunt_early:.2f}        {corners.late_hunt_late:.2f}"
    )
    historical = progress.historical_progress(caught)
    assert line_of(outcome.out, "progress against the run's own opponents") == signed(historical)
    dominant = [own.predators[g] for g in progress.dominant_generations(caught, int(EPISODES))]
    number = "generation" if len(dominant) == 1 else "generations"
    words = f"{len(dominant)} dominant: {number} {', '.join(map(str, dominant))}"
    assert line_of(outcome.out, "dominance tournament") == words
    ranked = 100 * games.decompose(caught, int(EPISODES)).transitive_share
    assert line_of(outcome.out, "who beats whom").startswith(f"{ranked:.0f}% by a ranking, {100 - ranked:.0f}% ")
    assert line_of(outcome.out, "as a game").startswith(f"value {games.solve_matrix(caught).value:.2f};")
    worst = games.exploitability_of_generations(caught)
    tail = f"predators {worst.predators[-1]:.2f}, prey {worst.prey[-1]:.2f}"
    assert line_of(outcome.out, "the last generation").endswith(tail)
    first = phases.phases(history.curves["caught"])[0]
    said_first = f"{first.start}-{first.end - 1}: {first.mean:.2f}"
    assert line_of(outcome.out, "phases of success").startswith(said_first)


def test_the_origins_of_genes_are_told_where_they_are_kept(esp_trainer: Callable[..., Any], place: Path) -> None:
    run = _train(place / "kept", "--genealogy", "true", generations=5)
    out = esp_trainer("analyse", run, "--episodes", "1").out
    both = of_run(run)
    left = ", ".join(f"{role} {each.founders[4]:.1f}" for role, each in both.items())
    assert line_of(out, "founders left") == f"{left} of 20 at a place of the gene string"
    share, bred = 100 * both["prey"].from_past[4], 4 - both["prey"].skipped[4]
    words = f"prey {share:.0f}% of the genes (bred in {bred:.0f} of 4 generations)"
    assert line_of(out, "from past champions").endswith(words)
    assert "founders left" not in esp_trainer("analyse", place / "short", "--episodes", "1").out


def test_a_single_run_is_not_measured_against_others(esp_trainer: Callable[..., Any], place: Path) -> None:
    outcome = esp_trainer("analyse", place / "first", "--episodes", EPISODES)
    assert "of the other runs" not in outcome.out
    assert "give runs of other seeds too" in outcome.out


def test_several_runs_are_measured_against_each_other(esp_trainer: Callable[..., Any], place: Path) -> None:
    outcome = esp_trainer("analyse", place / "first", place / "second", "--episodes", EPISODES)
    assert outcome.code == 0
    assert "give runs of other seeds" not in outcome.out
    both = [History.of_run(place / name) for name in ("first", "second")]
    evaluator = FusedEvaluator(both[0].config.env, threads=1)
    every, six = both[0].sample(46), both[0].sample(6)

    def meet(hunters: History, hunted: History, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        teams = hunters.entrants("predators", rows), hunted.entrants("prey", columns)
        return cross_play(*teams, evaluator, n_episodes=int(EPISODES)).caught

    told = [line for line in outcome.out.splitlines() if "progress against those of the other runs" in line]
    assert len(told) == 2
    for line, mine, other in zip(told, both, both[::-1], strict=True):
        against = progress.global_progress([meet(mine, other, every, six)], [meet(other, mine, six, every)])
        assert line.endswith(signed(against))


def test_a_run_against_a_script_is_told_from_early_to_late(esp_trainer: Callable[..., Any], place: Path) -> None:
    outcome = esp_trainer("analyse", place / "fleeing", "--episodes", EPISODES, "--generations", "8")
    assert outcome.code == 0
    _, own = own_of(place / "fleeing", 8)
    assert own.caught.shape == (8, 1)
    shares = " ".join(f"{share:.2f}" for share in own.caught[:, 0])
    assert line_of(outcome.out, "prey caught, from early to late") == shares


def test_how_many_generations_and_episodes_can_be_said(esp_trainer: Callable[..., Any], place: Path) -> None:
    outcome = esp_trainer("analyse", place / "first", "--episodes", "24", "--generations", "5")
    assert outcome.out.splitlines()[1].strip().startswith("5 x 5 generations, 24 episodes each")


def test_figures_are_drawn_with_their_data(esp_trainer: Callable[..., Any], place: Path, tmp_path: Path) -> None:
    figures = tmp_path / "new" / "figures"
    runs = place / "first", place / "fleeing"
    for run in runs:
        assert esp_trainer("analyse", run, "--episodes", EPISODES, "--figures", figures).code == 0
    names = ["first-ciao", "first-master", "first-success", "fleeing-ciao", "fleeing-success"]
    assert sorted(file.name for file in figures.iterdir()) == [f"{n}{s}" for n in names for s in (".csv", ".png")]
    for name in names:
        assert matplotlib.image.imread(figures / f"{name}.png").std() > 0.05, "something is drawn"
    history, own = own_of(place / "first")

    def columns(name: str) -> dict[str, np.ndarray]:
        header, *rows = csv.reader((figures / f"{name}.csv").open())
        return dict(zip(header, np.array(rows, float).T, strict=True))

    drawn = columns("first-ciao")
    np.testing.assert_allclose(drawn["caught"].reshape(N, N), own.caught, rtol=1e-5)
    np.testing.assert_array_equal(drawn["prey"].reshape(N, N)[0], own.prey)
    np.testing.assert_allclose(columns("first-success")["caught"], history.curves["caught"], rtol=1e-5)
    predators, prey = (column for name, column in columns("first-master").items() if name != "generation")
    master = progress.master_tournament(own.caught)
    np.testing.assert_allclose(predators, master.predators, rtol=1e-5)
    np.testing.assert_allclose(prey, master.prey, rtol=1e-5)


def test_what_is_played_is_kept_with_the_run_and_says_the_same_again(
    esp_trainer: Callable[..., Any], place: Path, tmp_path: Path
) -> None:
    run = Path(shutil.copytree(place / "short", tmp_path / "run", ignore=shutil.ignore_patterns("analysis")))
    first = esp_trainer("analyse", run, "--episodes", EPISODES)
    kept = (run / "analysis" / "cross-play.safetensors").read_bytes()
    assert esp_trainer("analyse", run, "--episodes", EPISODES) == first
    assert (run / "analysis" / "cross-play.safetensors").read_bytes() == kept
    assert esp_trainer("resume", run, "--generations", "4", "--quiet").code == 0
    assert "4 x 4 generations" in esp_trainer("analyse", run, "--episodes", EPISODES).out


def test_runs_that_were_resumed_or_stopped_are_read_as_far_as_they_got(
    esp_trainer: Callable[..., Any], place: Path, tmp_path: Path
) -> None:
    run = Path(shutil.copytree(place / "short", tmp_path / "run"))
    config = (run / "config.json").read_text()
    (run / "config.json").write_text(config.replace('"generations": 3', '"generations": 30'))
    assert f"{run}: smoke, seed 0, 3 generations" in esp_trainer("analyse", run, "--episodes", EPISODES).out


# What is wrong.


def _file(place: Path, run: Path) -> Path:
    (run.parent / "file").write_text("hello")
    return run.parent / "file"


def _empty(place: Path, run: Path) -> Path:
    (run.parent / "empty").mkdir()
    return run.parent / "empty"


def _without(name: str) -> Callable[[Path, Path], Path]:
    def spoil(place: Path, run: Path) -> Path:
        (run / name).unlink()
        return run

    return spoil


def _cut(name: str) -> Callable[[Path, Path], Path]:
    def spoil(place: Path, run: Path) -> Path:
        (run / name).write_bytes((run / name).read_bytes()[:200])
        return run

    return spoil


WRONG: dict[str, tuple[Callable[[Path, Path], Path], str]] = {
    "no such directory": (lambda place, run: place / "nowhere", "nowhere holds no run: there is no config.json"),
    "a directory without a run": (_empty, "empty holds no run: there is no config.json"),
    "a directory of runs": (lambda place, run: run.parent, "config.json; name one of its"),
    "a file": (_file, "file holds no run: there is no config.json"),
    "no checkpoint": (_without("checkpoint.safetensors"), "has no checkpoint yet: there is nothing to analyse"),
    "no log": (_without("metrics.jsonl"), "metrics.jsonl must hold 22 whole lines, got 0"),
    "a damaged config": (_cut("config.json"), "config.json is damaged"),
    "a damaged checkpoint": (_cut("checkpoint.safetensors"), "checkpoint.safetensors is damaged"),
}


def refusal_of(esp_trainer: Callable[..., Any], command: str, runs: list[Path]) -> str:
    """The one line of a refusal; ``report`` is not to leave a page beside them."""
    out = ["--out", "page.html"] if command == "report" else []
    return str(esp_trainer(command, *runs, *out).refusal)


COMMANDS = ["analyse", "behaviours", "report"]


@pytest.mark.parametrize("command", COMMANDS)
def test_runs_of_different_configs_are_not_pooled(
    command: str, esp_trainer: Callable[..., Any], place: Path, tmp_path: Path
) -> None:
    first = place / "first"
    for name, differs in {
        "elsewhere": ("env.size=12", "env.size=14"),
        "fleeing": ("prey.policy=esp", "prey.policy=flee_nearest"),
        "other trials": ("esp.n_trials=100", "esp.n_trials=90"),
    }.items():
        assert refusal_of(esp_trainer, command, [first, place / name]) == (
            f"esp-trainer: runs must differ in nothing but their seeds, got {first} with {differs[0]} and "
            f"{place / name} with {differs[1]}; measure them one at a time"
        )


@pytest.mark.parametrize("command", COMMANDS)
def test_a_run_is_not_measured_beside_itself(
    command: str, esp_trainer: Callable[..., Any], place: Path, tmp_path: Path
) -> None:
    first, short = place / "first", place / "short"
    assert refusal_of(esp_trainer, command, [first, first]) == (
        f"esp-trainer: runs must be different ones, got {first}, {first}"
    )
    assert refusal_of(esp_trainer, command, [first, short]) == (
        f"esp-trainer: runs must have different seeds, got {first} and {short} with 0"
    )


@pytest.mark.parametrize("command", COMMANDS)
def test_runs_of_different_lengths_are_measured_as_far_as_all_go(
    command: str, esp_trainer: Callable[..., Any], place: Path
) -> None:
    out = ["--out", "page.html"] if command == "report" else []
    few = ["--episodes", 8, "--generations", 4]
    outcome = esp_trainer(command, place / "short", place / "second", *few, *out)
    assert outcome.code == 0
    assert "note: The runs have 3 to 22 generations: the first 3 of each are measured." in outcome.err.splitlines()
    if command == "analyse":
        assert f"{place / 'second'}: smoke, seed 1, 3 generations" in outcome.out
    if command == "behaviours":
        assert "generation                   0       1       2\n" in outcome.out


@pytest.mark.parametrize("command", COMMANDS)
def test_runs_that_keep_other_champions_are_said_to(
    command: str, esp_trainer: Callable[..., Any], tmp_path: Path
) -> None:
    small = ["--esp.hof_size", "3", "--esp.subpopulation_size", "8", "--esp.hof_mates", "1", "--esp.n_trials", "16"]
    runs = [_train(tmp_path / f"{n}", *small, "--seed", str(n), generations=n) for n in (4, 9)]
    outcome = esp_trainer(command, *runs, "--episodes", 8)
    assert [line for line in outcome.err.splitlines() if line.startswith("note: ")] == [
        "note: The runs have 4 to 9 generations: the first 4 of each are measured.",
        "note: Champions of only 1 generation are kept by all runs.",
    ]
    if command == "report":
        assert "Champions of only 1 generation are kept by all runs." in (tmp_path / "report.html").read_text("utf-8")


@pytest.mark.parametrize("command", ["analyse", "behaviours"])
@pytest.mark.parametrize(("spoil", "says"), WRONG.values(), ids=WRONG)
def test_runs_that_cannot_be_analysed_are_refused_in_one_line(
    spoil: Callable[[Path, Path], Path],
    says: str,
    command: str,
    esp_trainer: Callable[..., Any],
    place: Path,
    tmp_path: Path,
) -> None:
    run = Path(shutil.copytree(place / "second", tmp_path / "run"))
    wrong = spoil(place, run)
    for runs in ([place / "first", wrong], [wrong]):
        outcome = esp_trainer(command, *runs)
        assert outcome.code == 1
        assert says in outcome.refusal
        assert outcome.refusal.startswith("esp-trainer: ")


OPTIONS: dict[str, tuple[list[str], str]] = {
    "no run": (["analyse"], "required: RUN"),
    "no run to watch": (["behaviours"], "required: RUN"),
    "no generations": (["analyse", "{first}", "--generations", "0"], "at least 1, got "),
    "episodes in words": (["analyse", "{first}", "--episodes", "many"], "at least 1, got 'many'"),
    "an option of another command": (["analyse", "{first}", "--csv", "t.csv"], "unexpected '--csv'"),
    "figures of behaviours": (["behaviours", "{first}", "--figures", "here"], "unexpected '--figures'"),
}


@pytest.mark.parametrize(("command", "says"), OPTIONS.values(), ids=OPTIONS)
def test_options_that_are_wrong_are_refused_in_one_line(
    command: list[str], says: str, esp_trainer: Callable[..., Any], place: Path, tmp_path: Path
) -> None:
    assert says in esp_trainer(*(word.format(first=place / "first") for word in command)).refusal
    assert not list(tmp_path.iterdir())


def test_figures_that_cannot_be_written_are_refused_before_anything_is_played(
    esp_trainer: Callable[..., Any], place: Path, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("hello")
    for where in ("file", "file/below"):
        refusal = esp_trainer("analyse", place / "short", "--episodes", EPISODES, "--figures", where).refusal
        assert refusal.startswith("esp-trainer: file")
    assert (tmp_path / "file").read_text() == "hello"
