"""A run's log for TensorBoard, read back with TensorBoard's own reader."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

from esp_trainer.cli import main

accumulators = pytest.importorskip("tensorboard.backend.event_processing.event_accumulator")


def scalars(directory: Path) -> dict[str, list[tuple[int, float]]]:
    read = accumulators.EventAccumulator(str(directory), size_guidance={"scalars": 0})
    read.Reload()
    tensors = read.Tags()["tensors"]
    import tensorboard.util.tensor_util as tensor_util

    return {
        tag: [(event.step, float(tensor_util.make_ndarray(event.tensor_proto))) for event in read.Tensors(tag)]
        for tag in tensors
    }


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
    assert 'install predprey-esp with its extra "tensorboard"' in line
    assert not run.exists()
