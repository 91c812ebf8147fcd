"""What of a run can be shown: all of it, or what is whole."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from esp_trainer.analysis.genealogy import of_run
from esp_trainer.analysis.history import History
from esp_trainer.cli import main
from esp_trainer.files import DamagedFileError
from esp_trainer.report.source import read_source

GENERATIONS = 24


def cut(file: Path) -> None:
    file.write_bytes(file.read_bytes()[:-20])


def test_a_whole_run_misses_nothing(run: Path) -> None:
    source, history = read_source(run), History.of_run(run)
    assert source.missing == ()
    assert source.history is not None
    assert len(source) == len(source.history) == GENERATIONS
    for role, champions in history.champions.items():
        assert (source.history.champions[role] == champions).all()
        assert source.spreads[role].shape == (GENERATIONS, 4)
    assert (source.curves["caught"] == history.curves["caught"]).all()
    assert set(source.seconds) == {"trials", "champions", "held_out", "breeding", "files"}


def test_the_first_generations_are_those_of_the_whole(run: Path) -> None:
    whole, part = read_source(run), read_source(run).first(10)
    assert len(part) == 10
    assert whole.history is not None
    assert part.history is not None
    assert (part.history.champions["prey"] == whole.history.champions["prey"][:10]).all()
    assert (part.curves["caught"] == whole.curves["caught"][:10]).all()
    assert (part.spreads["prey"] == whole.spreads["prey"][:10]).all()


@pytest.mark.parametrize("harm", [Path.unlink, cut])
def test_without_its_checkpoint_a_run_still_has_its_champions(run: Path, harm: Callable[[Path], None]) -> None:
    expected = read_source(run)
    harm(run / "checkpoint.safetensors")
    source = read_source(run)
    assert source.history is not None
    assert expected.history is not None
    for role, champions in expected.history.champions.items():
        assert (source.history.champions[role] == champions).all()
    assert ("checkpoint.safetensors is damaged" in " ".join(source.missing)) == (harm is cut)


def test_champions_go_as_far_as_they_are_whole(run: Path) -> None:
    (run / "checkpoint.safetensors").unlink()
    cut(run / "champions/prey-00017.safetensors")
    source = read_source(run)
    assert len(source) == 17
    assert len(source.curves["caught"]) == 17
    (line,) = source.missing
    assert "prey-00017.safetensors is damaged" in line
    assert "later champions are left out" in line


def test_a_run_without_champions_has_its_curves(run: Path) -> None:
    (run / "checkpoint.safetensors").unlink()
    for file in (run / "champions").iterdir():
        file.unlink()
    source = read_source(run)
    assert source.history is None
    assert len(source) == GENERATIONS
    assert source.missing == ("champions holds no predators: no match can be played.",)


def test_a_run_without_its_log_has_its_champions(run: Path) -> None:
    (run / "metrics.jsonl").unlink()
    source = read_source(run)
    assert source.curves == {}
    assert source.spreads == {}
    assert source.history is not None
    assert np.isnan(source.history.curves["caught"]).all()
    assert source.missing == ("There is no metrics.jsonl: no curves of success.",)


def swapped(lines: list[str]) -> list[str]:
    return [lines[1], lines[0], *lines[2:]]


def broken(lines: list[str]) -> list[str]:
    return [*lines[:7], lines[7][:40], *lines[8:]]


def emptied(lines: list[str]) -> list[str]:
    return [*lines[:7], json.dumps({"generation": 7}), *lines[8:]]


@pytest.mark.parametrize(("harm", "kept"), [(broken, 7), (emptied, 7)])
def test_a_log_counts_up_to_its_first_line_that_is_damaged(
    run: Path, harm: Callable[[list[str]], list[str]], kept: int
) -> None:
    log = run / "metrics.jsonl"
    log.write_text("\n".join(harm(log.read_text().splitlines())) + "\n")
    source = read_source(run)
    assert len(source) == kept
    assert source.missing == (f"metrics.jsonl is damaged: its line {kept + 1} and those after it are left out.",)


def test_a_log_that_is_damaged_from_the_start_is_none(run: Path) -> None:
    log = run / "metrics.jsonl"
    log.write_text("\n".join(swapped(log.read_text().splitlines())) + "\n")
    source = read_source(run)
    assert source.curves == {}
    assert len(source) == GENERATIONS


def test_a_log_from_before_signals_were_told_still_tells_of_diversity(run: Path) -> None:
    log = run / "metrics.jsonl"
    lines = [json.loads(line) for line in log.read_text().splitlines()]
    for line in lines:
        for told in line["subpopulations"].values():
            del told["signal"], told["ties"]
    log.write_text("".join(json.dumps(line) + "\n" for line in lines))
    source = read_source(run)
    assert source.missing == ()
    assert not np.isnan(source.spreads["prey"][:, :2]).any()
    assert np.isnan(source.spreads["prey"][:, 2:]).all()


def test_an_older_log_says_nothing_of_diversity(run: Path) -> None:
    log = run / "metrics.jsonl"
    lines = [json.loads(line) for line in log.read_text().splitlines()]
    log.write_text(
        "".join(json.dumps({k: v for k, v in line.items() if k != "subpopulations"}) + "\n" for line in lines)
    )
    source = read_source(run)
    assert source.spreads == {}
    assert len(source) == GENERATIONS
    assert source.missing == (
        "The log does not say how diverse the subpopulations were: it was made before that was recorded.",
    )


@pytest.mark.parametrize(
    "harm", [Path.unlink, lambda file: file.write_text("{}\n"), lambda file: file.write_text("x\n")]
)
def test_timings_may_be_lost(run: Path, harm: Any) -> None:
    harm(run / "timing.jsonl")
    source = read_source(run)
    assert source.missing == ("timing.jsonl cannot be read: no timings.",) or source.seconds == {}
    assert len(source) == GENERATIONS


def test_a_run_that_has_just_begun_says_so(run: Path) -> None:
    (run / "checkpoint.safetensors").unlink()
    for file in (run / "champions").iterdir():
        file.unlink()
    (run / "metrics.jsonl").write_text("")
    with pytest.raises(ValueError, match="has no generation yet: there is nothing to show"):
        read_source(run)


def test_what_is_no_run_or_of_another_schema_is_refused(run: Path, tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="holds no run"):
        read_source(tmp_path / "nowhere")
    config = run / "config.json"
    config.write_text(config.read_text().replace('"schema": 1', '"schema": 0'))
    with pytest.raises(DamagedFileError, match="schema must be 1, got 0"):
        read_source(run)


def test_a_generation_without_its_timing_is_interpolated(run: Path) -> None:
    """A kill may cost a line; and while a run goes on, its last one may not be there yet."""
    log = run / "timing.jsonl"
    lines = [{"generation": number, "trials": number**2, "files": 1} for number in range(GENERATIONS)]
    log.write_text("".join(json.dumps(line) + "\n" for line in (*lines[:3], *lines[4:-1])))
    source = read_source(run)
    assert source.missing == (f"timing.jsonl lacks 2 of {GENERATIONS} generations: they are interpolated.",)
    assert source.seconds["trials"].tolist() == [0, 1, 4, 10, *(n**2 for n in range(4, 23)), 22**2]
    assert (source.seconds["files"] == 1).all()


@pytest.fixture(scope="module")
def with_genealogy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("runs") / "kept"
    assert main(["train", "smoke", "--genealogy", "true", "--generations", "6", "--out", str(path), "--quiet"]) == 0
    return path


def test_a_genealogy_is_read_where_it_was_kept(run: Path, with_genealogy: Path) -> None:
    assert read_source(run).genealogies == {}
    source = read_source(with_genealogy)
    assert source.missing == ()
    for role, whole in of_run(with_genealogy).items():
        assert (source.genealogies[role].founders == whole.founders).all()
        assert len(source.first(4).genealogies[role]) == 4


@pytest.mark.parametrize(
    ("harm", "says"),
    [
        (Path.unlink, "is not there"),
        (cut, "the genealogy of the prey holds only 5 of 6 generations"),
        (lambda file: file.write_bytes(b""), "prey.bin is damaged"),
    ],
)
def test_a_damaged_genealogy_is_left_out(harm: Any, says: str, with_genealogy: Path, tmp_path: Path) -> None:
    copy = Path(shutil.copytree(with_genealogy, tmp_path / "copy"))
    harm(copy / "genealogy/prey.bin")
    source = read_source(copy)
    assert source.genealogies == {}
    (line,) = source.missing
    assert says in line
    assert line.endswith(": no origins of genes.")
