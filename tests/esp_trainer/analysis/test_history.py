"""A run as it is analysed: the same from memory, from its directory and from a file."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from esp_trainer.analysis.history import History
from esp_trainer.config import RunConfig
from esp_trainer.esp.team import Team
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.files import DamagedFileError
from esp_trainer.presets import preset
from esp_trainer.run.directory import RunDirectory
from esp_trainer.run.trainer import Trainer
from esp_trainer.types import ROLES, EvolvedTeams, Role, ScriptedTeams

N = 6


def small(policies: dict[Role, str] | None = None, kind: str = "split", **changes: Any) -> RunConfig:
    config = preset("smoke").replace(generations=N, checkpoint_every=2)
    for role in ROLES:
        policy = (policies or {}).get(role, "esp")
        config = config.replace(**{role: getattr(config, role).replace(controller=kind, n_hidden=2, policy=policy)})
    esp = config.esp.replace(subpopulation_size=8, n_trials=16, n_episodes=1)
    return config.replace(esp=esp, champion=config.champion.replace(n_candidates=2, n_held_out=8)).replace(**changes)


def evolve(config: RunConfig, **arguments: Any) -> History:
    return History.evolve(config, FusedEvaluator(config.env, threads=1), **arguments)


def train(path: Path, config: RunConfig) -> Path:
    list(Trainer.start(RunDirectory(path), config, lambda c: FusedEvaluator(c.env, threads=1)).generations())
    return path


def same(a: History, b: History) -> bool:
    """To the byte, and with the same types and shapes."""

    def content(history: History) -> Any:
        arrays = {**history.champions, **history.curves, "kept": history.kept}
        return history.config, {k: (v.dtype, v.shape, v.tobytes()) for k, v in arrays.items()}, list(history.champions)

    return bool(content(a) == content(b))


SETTINGS = {
    "both evolve": small(),
    "a central controller": small(kind="central"),
    "opponents from the hall of fame": small(esp=small().esp.replace(pairing="hall_of_fame")),
    "a small hall of fame": small(esp=small().esp.replace(hof_size=3)),
    "scripted prey": small({"prey": "flee_nearest"}),
    "scripted predators": small({"predators": "greedy_chase"}),
}
each_setting = pytest.mark.parametrize("config", SETTINGS.values(), ids=SETTINGS)


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run directory, not to be changed."""
    return train(tmp_path_factory.mktemp("runs") / "run", small())


@pytest.fixture
def run(trained: Path, tmp_path: Path) -> Path:
    """One to spoil."""
    return Path(shutil.copytree(trained, tmp_path / "run"))


@each_setting
def test_a_run_in_memory_is_the_run_that_the_trainer_writes(config: RunConfig, tmp_path: Path):
    assert same(evolve(config), History.of_run(train(tmp_path / "run", config)))


def test_its_champions_are_those_of_the_champion_files(trained: Path):
    history = History.of_run(trained)
    for role in ROLES:
        for generation in range(N):
            saved = Team.load(RunDirectory(trained).champion_file(role, generation))
            np.testing.assert_array_equal(history.champions[role][generation], saved.genomes)


def test_of_a_long_run_the_champions_are_those_that_are_kept(tmp_path: Path):
    path = train(tmp_path / "run", small(esp=small().esp.replace(hof_size=4), generations=11))
    history = History.of_run(path)
    assert len(history) == 11
    assert history.kept.tolist() == [0, 4, 8, 10]
    assert history.sample(3).tolist() == [0, 8, 10]
    saved = Team.load(RunDirectory(path).champion_file("prey", 8))
    assert (history.team("prey", 8).genomes == saved.genomes).all()
    assert (history.genomes("prey", np.array([8, 4]))[0] == saved.genomes).all()
    assert history.first(9).kept.tolist() == [0, 4, 8]
    for generation in (7, 9, 11, -1):
        with pytest.raises(ValueError, match=f"no champion is kept of generation {generation}"):
            history.team("prey", generation)


def test_its_curves_are_those_of_the_log(trained: Path):
    curves, log = History.of_run(trained).curves, (trained / "metrics.jsonl").read_text().splitlines()
    for generation, line in enumerate(map(json.loads, log)):
        held_out, trials = line["held_out"], line["trials"]
        assert curves["caught"][generation] == held_out["caught"]["rate"]
        assert curves["all_caught"][generation] == held_out["predators_succeed"]["rate"]
        assert curves["none_caught"][generation] == held_out["prey_succeed"]["rate"]
        assert curves["steps"][generation] == held_out["steps"]
        assert curves["caught_by_even"][generation].tolist() == [rate["rate"] for rate in held_out["caught_by_even"]]
        assert curves["trials_caught"][generation].tolist() == [trials[role]["caught"] for role in ROLES]
        assert curves["trials_mean"][generation].tolist() == [trials[role]["mean"] for role in ROLES]


def test_it_is_followed_generation_by_generation():
    seen: list[int] = []
    evolve(small(generations=3), watch=lambda: seen.append(1))
    assert len(seen) == 3


def test_a_fixed_team_takes_the_place_of_a_side():
    config, other = small(generations=3), evolve(small(seed=5))
    history = evolve(config, fixed={"prey": other.player("prey", 2)})
    assert set(history.champions) == {"predators"}
    assert np.isnan(history.curves["trials_caught"][:, 1]).all()
    assert not np.isnan(history.curves["trials_caught"][:, 0]).any()
    assert not same(history, evolve(config))


@each_setting
def test_what_is_saved_is_loaded_again(config: RunConfig, tmp_path: Path):
    history = evolve(config)
    history.save(tmp_path / "history.safetensors")
    assert same(history, History.load(tmp_path / "history.safetensors"))


def test_of_a_scripted_side_the_trials_are_not_known():
    curves = evolve(SETTINGS["scripted prey"]).curves
    for name in ("trials_caught", "trials_mean"):
        assert np.isnan(curves[name]).tolist() == [[False, True]] * N


def test_a_run_that_goes_on_is_read_up_to_its_checkpoint(run: Path):
    """The log and the champions run ahead of it."""
    config = RunDirectory(run).read_config()
    shorter = run.with_name("shorter")
    train(shorter, config.replace(generations=4))
    shutil.copy(shorter / "checkpoint.safetensors", run)
    whole = evolve(config)
    champions = {role: array[:4] for role, array in whole.champions.items()}
    curves = {name: array[:4] for name, array in whole.curves.items()}
    assert same(History.of_run(run), History(config, champions, curves))


# What cannot be read.


def _cut_log(run: Path) -> None:
    lines = (run / "metrics.jsonl").read_text().splitlines(keepends=True)
    (run / "metrics.jsonl").write_text("".join(lines[:-1]))


def _spoil_line(run: Path, change: Callable[[dict[str, Any]], Any]) -> None:
    lines = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    change(lines[2])
    (run / "metrics.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))


SPOILT: dict[str, tuple[Callable[[Path], Any], type[Exception], str]] = {
    "no config": (lambda run: (run / "config.json").unlink(), FileNotFoundError, "holds no run"),
    "no checkpoint": (
        lambda run: (run / "checkpoint.safetensors").unlink(),
        FileNotFoundError,
        "has no checkpoint yet: there is nothing to analyse",
    ),
    "a damaged config": (lambda run: os.truncate(run / "config.json", 50), DamagedFileError, "config.json is damaged"),
    "a checkpoint that was cut": (
        lambda run: os.truncate(run / "checkpoint.safetensors", 3000),
        DamagedFileError,
        "checkpoint.safetensors is damaged",
    ),
    "a champion as checkpoint": (
        lambda run: shutil.copy(run / "champions/prey-00001.safetensors", run / "checkpoint.safetensors"),
        DamagedFileError,
        "must be a checkpoint, but is a team",
    ),
    "a short log": (_cut_log, DamagedFileError, "metrics.jsonl must hold 6 whole lines, got 5"),
    "no log": (
        lambda run: (run / "metrics.jsonl").unlink(),
        DamagedFileError,
        "metrics.jsonl must hold 6 whole lines, got 0",
    ),
    "a log of something else": (
        lambda run: (run / "metrics.jsonl").write_text("hello\n" * 6),
        DamagedFileError,
        "metrics.jsonl is damaged",
    ),
    "a log of numbers": (
        lambda run: (run / "metrics.jsonl").write_text("1\n" * 6),
        DamagedFileError,
        "metrics.jsonl is damaged",
    ),
    "a line without a field": (
        lambda run: _spoil_line(run, lambda line: line.pop("held_out")),
        DamagedFileError,
        "metrics.jsonl is damaged",
    ),
    "a line with fewer parities": (
        lambda run: _spoil_line(run, lambda line: line["held_out"]["caught_by_even"].pop()),
        DamagedFileError,
        "metrics.jsonl is damaged",
    ),
    "a rate in words": (
        lambda run: _spoil_line(run, lambda line: line["held_out"]["caught"].update(rate="often")),
        DamagedFileError,
        "metrics.jsonl is damaged",
    ),
}


@pytest.mark.parametrize(("spoil", "error", "says"), SPOILT.values(), ids=SPOILT)
def test_what_is_no_readable_run_is_refused_in_one_line(
    spoil: Callable[[Path], Any], error: type[Exception], says: str, run: Path
):
    spoil(run)
    with pytest.raises(error, match=says) as refusal:
        History.of_run(run)
    assert str(run) in str(refusal.value)
    assert len(str(refusal.value).splitlines()) == 1


def test_a_place_without_a_run_is_refused(tmp_path: Path):
    (tmp_path / "file").write_text("hello")
    for place in (tmp_path, tmp_path / "nowhere", tmp_path / "file"):
        with pytest.raises(FileNotFoundError, match="holds no run"):
            History.of_run(place)


def test_a_file_that_is_damaged_or_something_else_is_refused(tmp_path: Path, trained: Path):
    path = tmp_path / "history.safetensors"
    evolve(small(generations=2)).save(path)
    whole = path.read_bytes()
    for data in (b"", whole[:500], whole[:-1], whole[:-9] + b"\1" + whole[-8:], b"hello"):
        path.write_bytes(data)
        with pytest.raises(DamagedFileError, match="is damaged"):
            History.load(path)
    with pytest.raises(DamagedFileError, match="must be a history, but is a checkpoint"):
        History.load(trained / "checkpoint.safetensors")
    with pytest.raises(FileNotFoundError, match="is not there"):
        History.load(tmp_path / "nowhere")


# Who played.


@pytest.mark.parametrize(
    ("n", "expected"),
    [
        (1, [0]),
        (2, [0, 5]),
        (3, [0, 2, 5]),  # 2.5 goes to the even one
        (4, [0, 2, 3, 5]),
        (6, [0, 1, 2, 3, 4, 5]),
        (100, [0, 1, 2, 3, 4, 5]),
    ],
)
def test_generations_are_sampled_evenly_from_the_first_to_the_last(n: int, expected: list[int]):
    history = History(small(), {}, {"caught": np.zeros(6)})
    assert history.sample(n).tolist() == expected


def test_the_paper_samples_every_tenth_of_450_generations():
    history = History(small(), {}, {"caught": np.zeros(450)})
    sampled = history.sample(46)
    assert (sampled[0], sampled[-1], len(sampled)) == (0, 449, 46)
    assert set(np.diff(sampled)) <= {9, 10}


@pytest.mark.parametrize("kind", ["split", "combiner", "central"])
@pytest.mark.parametrize("role", ROLES)
def test_an_entrant_is_the_champion_of_its_generation(
    role: Role, kind: str, members: Callable[[EvolvedTeams], np.ndarray]
):
    history = evolve(small(kind=kind))
    entrants = history.entrants(role, np.array([4, 0, 4]))
    assert isinstance(entrants, EvolvedTeams)
    np.testing.assert_array_equal(members(entrants), history.champions[role][[4, 0, 4]])
    team = history.team(role, 4)
    np.testing.assert_array_equal(team.genomes, history.champions[role][4])
    assert team.role == role
    assert team.provenance["generation"] == 4
    assert team.provenance["seed"] == history.config.seed
    team.check_fits(role, history.config.env)


@pytest.mark.parametrize("role", ROLES)
def test_a_champion_plays_like_the_team_that_its_run_saved(role: Role, trained: Path):
    ours = History.of_run(trained).player(role, 3)
    saved = Team.load(RunDirectory(trained).champion_file(role, 3))
    assert isinstance(ours, Team)
    n_seen = 2 * (2 if role == "predators" else 3)
    generator = np.random.default_rng(0)
    prefix = "predator" if role == "predators" else "prey"
    for _ in range(50):
        seen = {f"{prefix}_{i}": generator.integers(-6, 6, n_seen).astype(np.float32) for i in range(5 - n_seen // 2)}
        assert ours.act(seen) == saved.act(seen)


def test_a_scripted_side_is_its_script_in_every_generation():
    history = evolve(SETTINGS["scripted prey"])
    assert history.entrants("prey", np.array([0, 3])) == ScriptedTeams("flee_nearest")
    assert history.player("prey", 3) == ScriptedTeams("flee_nearest")
    assert isinstance(history.player("predators", 3), Team)
    with pytest.raises(ValueError, match="the prey of this run are a script: flee_nearest"):
        history.team("prey", 3)
