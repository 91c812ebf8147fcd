"""A run with a league has the same bytes however it was stopped, and goes on only with the league that it has."""

from __future__ import annotations

import shutil
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from esp_trainer.coevolution.league import League, LeagueSource
from esp_trainer.coevolution.sides import EvolvingSide, new_sides
from esp_trainer.config import RunConfig
from esp_trainer.esp.team import Team
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.files import DamagedFileError, read_arrays, write_arrays
from esp_trainer.run.checkpoint import load_checkpoint
from esp_trainer.run.directory import RunDirectory
from esp_trainer.run.trainer import Trainer
from esp_trainer.seeding import stream
from esp_trainer.types import ROLES

if TYPE_CHECKING:
    from collections.abc import Callable


@pytest.fixture(scope="module")
def config(tiny: RunConfig) -> RunConfig:
    """Half of the episodes are against a pool that is soon full, chosen by remembered results."""
    esp = {"n_episodes": 2, "past_share": 0.5, "past_choice": "contested", "past_each_episode": True, "hof_size": 4}
    return tiny.replace(esp=tiny.esp.replace(**esp), champion=tiny.champion.replace(n_past=2))


def guests_for(config: RunConfig, n: int = 3) -> League:
    genomes = {
        role: stream(0, f"guests {role}").normal(size=(n, *side.hall_of_fame.champions.shape[1:]))
        for role, side in new_sides(config).items()
        if isinstance(side, EvolvingSide)
    }
    return League(genomes, (LeagueSource("runs/a", "smoke", 7, (0, 3, 5)),))


@pytest.fixture
def start_with_league(config: RunConfig) -> Callable[..., Trainer]:
    """``start_with_league(path)``: a new run with three guests a side."""

    def begin(path: Path, threads: int = 2) -> Trainer:
        guests = guests_for(config)
        return Trainer.start(RunDirectory(path), config, lambda c: FusedEvaluator(c.env, threads), guests)

    return begin


@pytest.fixture
def whole(tmp_path: Path, start_with_league: Any, snapshot: Any) -> dict[str, bytes]:
    """What a run with a league leaves that nothing stopped."""
    list(start_with_league(tmp_path / "whole").generations())
    return dict(snapshot(tmp_path / "whole"))


def test_the_run_holds_its_league_and_says_so_everywhere(
    config: RunConfig, tmp_path: Path, whole: dict[str, bytes]
) -> None:
    digest = guests_for(config).digest
    assert RunDirectory(tmp_path / "whole").read_config() == config.replace(league=digest)
    header, arrays = read_arrays(tmp_path / "whole/league.safetensors", "league")
    assert header["sources"] == [{"path": "runs/a", "preset": "smoke", "seed": 7, "generations": [0, 3, 5]}]
    assert all((arrays[role] == guests_for(config).genomes[role]).all() for role in ROLES)
    assert Team.load(tmp_path / "whole/champions/prey-00000.safetensors").provenance["league"] == digest


def test_a_league_changes_the_run_from_the_first_generation_on(
    config: RunConfig, whole: dict[str, bytes], uninterrupted: Any
) -> None:
    without = uninterrupted(config)
    assert without.keys() == whole.keys() - {"league.safetensors"}
    one, other = (files["metrics.jsonl"].splitlines()[0] for files in (without, whole))
    assert one != other


def test_every_generation_is_a_good_place_to_die(
    tmp_path: Path, start_with_league: Any, resume: Any, snapshot: Any, whole: dict[str, bytes]
) -> None:
    for generation in range(1, 7):
        path = tmp_path / str(generation)
        list(islice(start_with_league(path).generations(), generation))
        list(resume(path).generations())
        assert snapshot(path) == whole, generation


def test_a_run_that_is_killed_before_its_first_checkpoint_keeps_its_league(
    tmp_path: Path, start_with_league: Any, resume: Any, snapshot: Any, whole: dict[str, bytes]
) -> None:
    start_with_league(tmp_path / "run").directory.unlock()
    list(resume(tmp_path / "run").generations())
    assert snapshot(tmp_path / "run") == whole


def test_threads_do_not_change_a_byte(
    tmp_path: Path, start_with_league: Any, snapshot: Any, whole: dict[str, bytes]
) -> None:
    for threads in (1, 7):
        list(start_with_league(tmp_path / str(threads), threads).generations())
        assert snapshot(tmp_path / str(threads)) == whole


def test_a_run_that_is_copied_elsewhere_goes_on(
    tmp_path: Path, start_with_league: Any, resume: Any, snapshot: Any, whole: dict[str, bytes]
) -> None:
    list(islice(start_with_league(tmp_path / "run").generations(), 3))
    shutil.copytree(tmp_path / "run", tmp_path / "else/where")
    shutil.rmtree(tmp_path / "run")
    list(resume(tmp_path / "else/where").generations())
    assert snapshot(tmp_path / "else/where") == whole


def _spoil(file: Path) -> None:
    data = file.read_bytes()
    file.write_bytes(data[:-1] + bytes([data[-1] ^ 1]))


def _exchange(file: Path) -> None:
    """Write other champions, with the digest that is theirs."""
    header, arrays = read_arrays(file, "league")
    del header["kind"], header["schema"]
    write_arrays(file, "league", header, {role: genomes + np.float32(1) for role, genomes in arrays.items()})


SPOILT: dict[str, tuple[Callable[[Path], object], type[Exception], str]] = {
    "missing": (Path.unlink, FileNotFoundError, "is not there"),
    "damaged": (_spoil, DamagedFileError, "is damaged: its contents do not match their digest"),
    "others": (_exchange, DamagedFileError, r"holds another league: \w{64}, and the run's is \w{64}"),
}


@pytest.mark.parametrize(("spoil", "error", "line"), SPOILT.values(), ids=SPOILT)
@pytest.mark.parametrize("done", [0, 3, 6])
def test_a_run_whose_league_is_missing_or_altered_is_not_gone_on_with(
    done: int,
    spoil: Callable[[Path], object],
    error: type[Exception],
    line: str,
    tmp_path: Path,
    start_with_league: Any,
    resume: Any,
    snapshot: Any,
) -> None:
    trainer = start_with_league(tmp_path / "run")
    list(islice(trainer.generations(), done))
    trainer.directory.unlock()
    file = tmp_path / "run/league.safetensors"
    kept = file.read_bytes()
    spoil(file)
    before = snapshot(tmp_path)
    with pytest.raises(error, match=rf"^{file} {line}$"):
        resume(tmp_path / "run")
    assert snapshot(tmp_path) == before
    file.write_bytes(kept)
    assert resume(tmp_path / "run").done == done // 2 * 2


def test_a_run_that_could_not_begin_leaves_nothing_behind(config: RunConfig, tmp_path: Path) -> None:
    def fail(_: RunConfig) -> Any:
        raise MemoryError

    with pytest.raises(MemoryError):
        Trainer.start(RunDirectory(tmp_path / "run"), config, fail, guests_for(config))
    assert not (tmp_path / "run").exists()


def test_a_league_that_does_not_fit_or_is_never_met_is_refused_before_anything_is_written(
    tiny: RunConfig, config: RunConfig, tmp_path: Path, start: Any
) -> None:
    wide = guests_for(config.replace(**{role: getattr(config, role).replace(n_hidden=3) for role in ROLES}))
    with pytest.raises(ValueError, match=r"^a guest must have shape \(3, 2, 2, 7\), got \(3, 2, 3, 7\)$"):
        Trainer.start(RunDirectory(tmp_path / "run"), config, FusedEvaluator, wide)
    with pytest.raises(ValueError, match="a league has no effect"):
        Trainer.start(RunDirectory(tmp_path / "run"), tiny, FusedEvaluator, guests_for(tiny))
    with pytest.raises(ValueError, match="the config names the league abc, got none"):
        start(tmp_path / "run", config.replace(league="abc"))
    assert list(tmp_path.iterdir()) == []


def test_the_rest_of_a_start_that_was_killed_before_its_config_is_begun_anew(
    config: RunConfig,
    tmp_path: Path,
    start: Any,
    start_with_league: Any,
    snapshot: Any,
    uninterrupted: Any,
    whole: dict[str, bytes],
) -> None:
    """Whether it is the same run again, or one without a league."""
    for name in ("again", "without"):
        start_with_league(tmp_path / name).directory.unlock()
        (tmp_path / name / "config.json").unlink()
        (tmp_path / name / ".league.safetensors.part").write_bytes(b"half")
    list(start_with_league(tmp_path / "again").generations())
    list(start(tmp_path / "without", config).generations())
    assert snapshot(tmp_path / "again") == whole
    assert snapshot(tmp_path / "without") == uninterrupted(config)


def test_a_league_is_on_disk_before_the_config_that_makes_it_a_run(
    tmp_path: Path, start_with_league: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Or a start that is killed in between would leave a run that nobody can go on with."""
    order = []
    write_config = RunDirectory.write_config

    def spy_sync(path: Path) -> None:
        order.append(("sync", sorted(file.name for file in path.iterdir())))

    def spy_write(directory: RunDirectory, config: RunConfig) -> None:
        order.append(("config", sorted(file.name for file in directory.path.iterdir())))
        write_config(directory, config)

    monkeypatch.setattr("esp_trainer.run.directory.sync_directory", spy_sync)
    monkeypatch.setattr(RunDirectory, "write_config", spy_write)
    start_with_league(tmp_path / "run")
    assert order == [(what, ["champions", "league.safetensors"]) for what in ("sync", "config")]


def test_somebodys_own_copy_of_a_league_is_not_overwritten(tmp_path: Path, start_with_league: Any) -> None:
    (tmp_path / "kept").mkdir()
    (tmp_path / "kept/league.safetensors").write_bytes(b"mine")
    with pytest.raises(FileExistsError, match="is not an empty directory, and holds no run"):
        start_with_league(tmp_path / "kept")
    assert (tmp_path / "kept/league.safetensors").read_bytes() == b"mine"


def test_a_checkpoint_is_read_without_its_league_and_with_it(
    config: RunConfig, tmp_path: Path, whole: dict[str, bytes]
) -> None:
    """To look at a run's own champions takes no league."""
    guests = guests_for(config)
    file, config = tmp_path / "whole/checkpoint.safetensors", guests.enter(config)
    arrays = read_arrays(file, "checkpoint")[1]
    for league, n_guests in ((guests, 3), (League(), 0)):
        sides, done = load_checkpoint(file, config, league)
        assert done == 6
        for role, side in sides.items():
            assert isinstance(side, EvolvingSide)
            fame = side.hall_of_fame
            assert (len(fame.guests), len(fame.champions)) == (n_guests, 4)
            assert (fame.met[n_guests:] == arrays[f"{role}.met"]).all()
            assert (fame.met[:n_guests] == arrays[f"{role}.guests_met"][:n_guests]).all()
            assert arrays[f"{role}.guests_met"].all()  # all were met, and won something


@pytest.mark.parametrize("change", ["missing", "too short"])
def test_a_checkpoint_without_results_of_its_guests_is_not_usable(
    change: str, config: RunConfig, tmp_path: Path, whole: dict[str, bytes]
) -> None:
    file = tmp_path / "whole/checkpoint.safetensors"
    header, arrays = read_arrays(file, "checkpoint")
    del header["kind"], header["schema"]
    met = arrays.pop("prey.guests_met")
    if change == "too short":
        arrays["prey.guests_met"] = met[:2].copy()
    write_arrays(file, "checkpoint", header, arrays)
    guests = guests_for(config)
    with pytest.raises(DamagedFileError, match=rf"^{file} is not a usable checkpoint: prey.guests_met"):
        load_checkpoint(file, guests.enter(config), guests)


def test_a_run_without_a_league_has_no_file_and_no_array_of_one(
    config: RunConfig, tmp_path: Path, uninterrupted: Any
) -> None:
    assert "league.safetensors" not in uninterrupted(config)
    header, arrays = read_arrays(tmp_path / "uninterrupted/checkpoint.safetensors", "checkpoint")
    assert header["config"]["league"] == ""
    assert set(arrays) == {f"{role}.{name}" for role in ROLES for name in ("genomes", "hall_of_fame", "met")}


def test_a_run_from_before_there_were_leagues_goes_on(
    config: RunConfig, tmp_path: Path, start: Any, resume: Any, snapshot: Any, uninterrupted: Any
) -> None:
    list(islice(start(tmp_path / "old", config).generations(), 3))
    old = RunDirectory(tmp_path / "old")
    text = old.config_file.read_text()
    assert text.count('"league": "",') == 1
    old.config_file.write_text(text.replace('"league": "",', ""))
    header, arrays = read_arrays(old.checkpoint_file, "checkpoint")
    del header["kind"], header["schema"], header["config"]["league"]
    write_arrays(old.checkpoint_file, "checkpoint", header, arrays)
    list(resume(tmp_path / "old").generations())
    new, gone_on_with = uninterrupted(config), snapshot(tmp_path / "old")
    assert {name for name in new if gone_on_with.pop(name) != new[name]} == {"config.json"}  # which stays as it was
    assert gone_on_with == {}
