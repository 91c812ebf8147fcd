"""The genealogy of a run: it changes nothing else, and has the same bytes after any interruption."""

from __future__ import annotations

import json
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from esp_trainer.algorithms.cosyne import Cosyne
from esp_trainer.esp.subpopulations import Subpopulations
from esp_trainer.files import DamagedFileError
from esp_trainer.presets import preset
from esp_trainer.run.directory import Log, RunDirectory
from esp_trainer.run.genealogy import Layout, read_genealogy
from esp_trainer.types import ROLES

if TYPE_CHECKING:
    from esp_trainer.config import RunConfig


@pytest.fixture(scope="session")
def kept(tiny: RunConfig) -> RunConfig:
    """A run that keeps its genealogy, with past champions as mates and exploiters."""
    esp = tiny.esp.replace(hof_mates=1, hof_size=3, past_share=1.0, exploiters_every=3, exploiter_generations=1)
    return tiny.replace(genealogy=True, esp=esp)


def test_a_genealogy_changes_no_other_byte(kept: RunConfig, tmp_path: Path, start: Any, snapshot: Any) -> None:
    found = []
    for genealogy in (False, True):
        list(start(tmp_path / str(genealogy), kept.replace(genealogy=genealogy)).generations())
        found.append(snapshot(tmp_path / str(genealogy)))
    without, with_it = found
    assert with_it.keys() - without.keys() == {"genealogy/predators.bin", "genealogy/prey.bin"}
    assert {name for name in without if without[name] != with_it[name]} == {"config.json"}


def test_records_hold_what_was_bred(kept: RunConfig, tmp_path: Path, start: Any) -> None:
    layout, records = Layout.of(kept, "prey"), []
    for generation in start(tmp_path, kept).generations():
        bred = generation.bred["prey"]
        records.append({**bred.parents._asdict(), "champion": bred.champion, "burst": bred.burst})
    assert layout == Layout((6,) * 12, size=8, n_elite=2, hof_mates=1)
    found, read_back = read_genealogy(tmp_path / "genealogy/prey.bin")
    assert found == layout
    assert len(read_back) == 6
    for name in records[0]:
        assert np.array_equal(read_back[name], [record[name] for record in records]), name
    assert (read_back["past"][0] == -1).all()
    assert set(read_back["past"][5].ravel()) <= {0, 4, 2}  # of five champions three are left
    assert len(set(read_back["past"][1:].ravel())) > 2
    slots = np.concatenate([read_back["elite"], read_back["children"]], axis=2)
    assert slots.max() == 7
    assert all(len(set(row)) == 6 for generation in slots for row in generation)  # the elite stays


def test_slots_and_cuts_take_the_smallest_integers_that_hold_them() -> None:
    layout = Layout((6, 5), size=257, n_elite=64, hof_mates=5)
    assert layout.record.itemsize == 4 + 1 + 2 * (2 + 64 * (2 + 2 + 1) + 128 * 2 + 5 * 4)
    assert Layout((6, 5), size=256, n_elite=64, hof_mates=0).record.itemsize == 4 + 1 + 2 * (1 + 64 * 3 + 128)


def test_a_generation_of_the_race_takes_what_its_page_says() -> None:
    config = preset("race-3v1")
    size = sum(Layout.of(config, role).record.itemsize for role in ROLES)
    assert size == 2 * 3785  # docs/training.md: 7.6 kB a generation, 11 MB for 1,500


@pytest.mark.parametrize("lived", [1, 2, 3, 5])
def test_a_run_that_dies_resumes_to_the_same_genealogy(
    lived: int, kept: RunConfig, tmp_path: Path, start: Any, resume: Any, snapshot: Any, uninterrupted: Any
) -> None:
    list(islice(start(tmp_path / "run", kept).generations(), lived))
    list(resume(tmp_path / "run").generations())
    assert snapshot(tmp_path / "run") == uninterrupted(kept)


def test_a_longer_run_begins_with_the_same_genealogy(
    kept: RunConfig, tmp_path: Path, start: Any, resume: Any, snapshot: Any, uninterrupted: Any
) -> None:
    list(start(tmp_path / "run", kept.replace(generations=3)).generations())
    list(resume(tmp_path / "run", 6).generations())
    assert snapshot(tmp_path / "run") == uninterrupted(kept)


@pytest.mark.parametrize("call", range(1, 7))
def test_a_generation_that_fails_while_it_is_written_is_written_once(
    call: int,
    kept: RunConfig,
    tmp_path: Path,
    start: Any,
    snapshot: Any,
    uninterrupted: Any,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    whole, write, calls = uninterrupted(kept), Log.write, iter(range(1, 1000))

    def torn(log: Log, record: bytes) -> None:
        if next(calls) == call:
            write(log, record[: len(record) // 2])
            raise OSError("disk full")
        write(log, record)

    trainer = start(tmp_path / "run", kept)
    monkeypatch.setattr(Log, "write", torn)
    with pytest.raises(OSError, match="disk full"):
        list(trainer.generations())
    list(trainer.generations())
    assert snapshot(tmp_path / "run") == whole


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="takes a disk that is always full")
def test_a_genealogy_that_does_not_fit_on_the_disk_is_named(
    kept: RunConfig, tmp_path: Path, start: Any, resume: Any, snapshot: Any, uninterrupted: Any
) -> None:
    trainer = start(tmp_path / "run", kept)
    file = tmp_path / "run/genealogy/prey.bin"
    file.parent.mkdir()
    file.symlink_to("/dev/full")
    with pytest.raises(OSError, match=rf"No space left on device: '{file}'"):
        list(trainer.generations())
    file.unlink()
    list(resume(tmp_path / "run").generations())
    assert snapshot(tmp_path / "run") == uninterrupted(kept)


def test_a_scripted_side_has_none(kept: RunConfig, tmp_path: Path, start: Any) -> None:
    config = kept.replace(prey={"policy": "flee_nearest"}, esp=kept.esp.replace(past_share=0.0, exploiters_every=0))
    list(start(tmp_path, config).generations())
    assert [file.name for file in (tmp_path / "genealogy").iterdir()] == ["predators.bin"]


def test_only_esp_keeps_a_genealogy(kept: RunConfig, tmp_path: Path, start: Any) -> None:
    with pytest.raises(ValueError, match=r"^genealogy must be false with prey.algorithm 'ga': only esp keeps one$"):
        kept.replace(prey={"algorithm": "ga"})
    trainer = start(tmp_path, kept)
    side = trainer.coevolution.sides["prey"]
    controller = side.algorithm.controller
    side.algorithm = Cosyne.start(kept.esp, controller, len(side.algorithm.genomes), np.random.default_rng())
    with pytest.raises(ValueError, match=r"^genealogy must be false: the prey are bred by Cosyne, not by esp$"):
        list(trainer.generations())


def test_parents_are_not_kept_unasked(kept: RunConfig, tmp_path: Path, start: Any) -> None:
    trainer = start(tmp_path, kept.replace(genealogy=False))
    assert [generation.bred for generation in trainer.generations()] == [{}] * 6
    population = trainer.coevolution.evolving["prey"].algorithm
    assert isinstance(population, Subpopulations)
    assert population.parents is None
    assert not (tmp_path / "genealogy").exists()


def _cut(file: Path) -> None:
    file.write_bytes(file.read_bytes()[:-1])


def _other_kind(file: Path) -> None:
    header, _, rest = file.read_bytes().partition(b"\n")
    file.write_bytes(json.dumps({**json.loads(header), "kind": "team"}).encode() + b"\n" + rest)


def _shifted(file: Path) -> None:
    header, _, rest = file.read_bytes().partition(b"\n")
    file.write_bytes(header + b"\n" + rest[1:])


def _other_sizes(file: Path) -> None:
    file.write_bytes(Layout((6,), size=8, n_elite=2, hof_mates=1).header)


@pytest.mark.parametrize(
    ("damage", "says"),
    [
        (Path.unlink, "is not there"),
        (_cut, "must hold 6 generations, got 5"),
        (_other_kind, "is damaged: it must be a genealogy of schema 1"),
        (_shifted, "is damaged: record 2 is not generation 1"),
        (_other_sizes, "is damaged: it belongs to another config"),
        (lambda file: file.write_bytes(b""), "is damaged: Expecting value: line 1 column 1 (char 0)"),
        (lambda file: file.write_bytes(b"[]\n"), "is damaged: it must be a genealogy of schema 1"),
        (
            lambda file: file.write_bytes(b'{"kind": "genealogy", "schema": 1}\n'),
            "is damaged: its header holds no sizes",
        ),
    ],
)
def test_a_damaged_genealogy_is_refused_in_one_line(
    damage: Any, says: str, kept: RunConfig, tmp_path: Path, start: Any, resume: Any
) -> None:
    list(start(tmp_path, kept).generations())
    file = RunDirectory(tmp_path).genealogy_file("predators")
    damage(file)
    with pytest.raises((DamagedFileError, FileNotFoundError)) as caught:
        resume(tmp_path)
    assert str(caught.value) == f"{file} {says}"
