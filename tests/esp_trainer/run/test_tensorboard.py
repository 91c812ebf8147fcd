"""A run's log for TensorBoard, read back with TensorBoard's own reader."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

from esp_trainer.cli import main
from esp_trainer.run.tensorboard import TensorBoardLog

accumulators = pytest.importorskip("tensorboard.backend.event_processing.event_accumulator")


def scalars(directory: Path) -> dict[str, list[tuple[int, float]]]:
    read = accumulators.EventAccumulator(str(directory), size_guidance={"scalars": 0})
    read.Reload()
    return {tag: [(event.step, event.value) for event in read.Scalars(tag)] for tag in read.Tags()["scalars"]}


def test_what_the_log_says_stands_there_too(tmp_path: Path) -> None:
    run = tmp_path / "run"
    assert main(["train", "smoke", "--generations", "4", "--out", str(run), "--quiet", "--tensorboard"]) == 0
    found = scalars(run / "tensorboard")
    lines = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    for tag, value in {
        "held_out/caught": lambda line: line["held_out"]["caught"]["rate"],
        "held_out/steps": lambda line: line["held_out"]["steps"],
        "trials/prey/mean": lambda line: line["trials"]["prey"]["mean"],
        "champions/predators": lambda line: line["champions"]["predators"],
        "subpopulations/prey/diversity": lambda line: line["subpopulations"]["prey"]["diversity"],
    }.items():
        assert found[tag] == [(i, pytest.approx(value(line))) for i, line in enumerate(lines)]
    assert len(found["seconds/trials"]) == 4


def test_a_resumed_run_goes_on_there(tmp_path: Path) -> None:
    run = tmp_path / "run"
    assert main(["train", "smoke", "--generations", "2", "--out", str(run), "--quiet", "--tensorboard"]) == 0
    assert main(["resume", str(run), "--generations", "4", "--quiet", "--tensorboard"]) == 0
    files = sorted((run / "tensorboard").iterdir())
    assert len(files) == 2
    steps = [step for file in files for step, _ in scalars(file)["held_out/caught"]]
    assert sorted(steps) == [0, 1, 2, 3]


def test_nothing_of_it_waits_in_memory(tmp_path: Path) -> None:
    """A killed process would take it along."""
    log = TensorBoardLog(tmp_path)
    for generation in range(3):
        log.add({"generation": generation, "caught": 0.5}, {"trials": 0.25})
        assert scalars(tmp_path)["caught"] == [(number, 0.5) for number in range(generation + 1)]
    log.close()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="takes a disk that is always full")
def test_a_full_disk_is_an_error_that_names_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    openly = Path.open
    monkeypatch.setattr(Path, "open", lambda path, mode: openly(Path("/dev/full"), "wb"))
    with pytest.raises(OSError, match=r"No space left on device: '.*tfevents") as raised:
        TensorBoardLog(tmp_path)
    assert raised.value.filename.startswith(str(tmp_path))


def test_it_is_written_only_when_asked_for(tmp_path: Path) -> None:
    run = tmp_path / "run"
    assert main(["train", "smoke", "--generations", "1", "--out", str(run), "--quiet"]) == 0
    assert not (run / "tensorboard").exists()


def test_without_tensorboard_it_says_what_to_install_and_begins_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.setitem(sys.modules, "tensorboard.summary", None)
    run = tmp_path / "run"
    assert main(["train", "smoke", "--generations", "1", "--out", str(run), "--tensorboard"]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line == 'esp-trainer: a log for TensorBoard needs tensorboard: pip install "predprey-esp[tensorboard]"'
    assert not run.exists()
