"""Mistakes in an algorithm of a user's own: each is told in one line, from the command line as in Python."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from esp_trainer.algorithms import WholeTeams
from esp_trainer.algorithms.ask_tell import AskTell
from esp_trainer.algorithms.registry import failures_told
from esp_trainer.analysis.history import History
from esp_trainer.arrays import Fitness
from esp_trainer.cli import main
from esp_trainer.esp.team import Team
from predprey_env.settings import PartError

SMALL = ["--generations", "2", "--esp.n_trials", "16", "--esp.subpopulation_size", "8", "--esp.hof_mates", "0"]


class _Kept(WholeTeams):
    """The same random teams in every generation."""

    def begin(self, generator: np.random.Generator) -> None:
        self.teams = self.first_vectors(4, generator)

    def vectors(self, generator: np.random.Generator) -> np.ndarray:
        return self.teams

    def learn(self, vectors: np.ndarray, scores: Fitness, generator: np.random.Generator) -> None:
        pass

    def around(self, vector: np.ndarray, generator: np.random.Generator) -> None:
        pass

    def state(self) -> dict[str, np.ndarray]:
        return {"teams": self.teams}

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        self.teams = state["teams"]


class BeginsBadly(_Kept):
    def begin(self, generator: np.random.Generator) -> None:
        raise KeyError("seed")


class AsksBadly(_Kept):
    def vectors(self, generator: np.random.Generator) -> np.ndarray:
        return np.zeros((4, 1)) @ np.zeros((2, 3))


class LearnsBadly(_Kept):
    def learn(self, vectors: np.ndarray, scores: Fitness, generator: np.random.Generator) -> None:
        raise KeyError("oops")


class NoTeams(_Kept):
    def ask(self, generator: np.random.Generator) -> Any:
        return None


class FewTeams(_Kept):
    def ask(self, generator: np.random.Generator) -> Any:
        return super().ask(generator).part(slice(3))


class NoState(_Kept):
    def state(self) -> Any:
        return None


class TextInState(_Kept):
    def state(self) -> Any:
        return {"teams": self.teams, "name": "mine"}


class ListInState(_Kept):
    def state(self) -> Any:
        return {"teams": self.teams.tolist()}


class Objects(_Kept):
    def state(self) -> Any:
        return {"teams": np.array([{}, {}])}


class NoOptimiser(AskTell):
    def optimiser(self, start: np.ndarray, seed: int) -> Any:
        return None


class RestoresBadly(_Kept):
    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        self.teams = state["tems"]


class RestoresNothing(_Kept):
    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        pass


class NumbersInState(_Kept):
    """Its step is a number of NumPy, and grows."""

    def begin(self, generator: np.random.Generator) -> None:
        super().begin(generator)
        self.step = np.float64(0.5)
        self.count = 0

    def learn(self, vectors: np.ndarray, scores: Fitness, generator: np.random.Generator) -> None:
        self.step, self.count = self.step * 1.5, self.count + 1
        self.teams = self.teams + np.float32(self.step)

    def state(self) -> Any:
        return super().state() | {"step": self.step, "count": self.count}

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        super().restore(state)
        self.step, self.count = np.float64(state["step"]), int(state["count"])


class NumberAsName(_Kept):
    def state(self) -> Any:
        return {1: self.teams}


MISTAKES = {
    BeginsBadly: r"predators: algorithm .* failed in start\(\): KeyError: 'seed' \(test_mistakes.py, line \d+\)",
    AsksBadly: r"algorithm .* failed in ask\(\): ValueError: matmul: .* \(test_mistakes.py, line \d+\)",
    LearnsBadly: r"algorithm .* failed in tell\(\): KeyError: 'oops' \(test_mistakes.py, line \d+\)",
    NoTeams: r"algorithm .*: ask\(\) must return EvolvedTeams of 16 trials, got NoneType",
    FewTeams: r"algorithm .*: ask\(\) must return EvolvedTeams of 16 trials, got of 3",
    NoState: r"predators: algorithm .*: state\(\) must return numbers, or arrays of them, by name, got NoneType",
    TextInState: r"predators: algorithm .*: state\(\) must return numbers, or arrays of them, by name, got str as name",
    ListInState: r"predators: algorithm .*: state\(\) must return numbers, or .* by name, got list as teams",
    Objects: r"predators: algorithm .*: state\(\) must return numbers, or .* by name, got an array of object as teams",
    NumberAsName: r"predators: algorithm .*: state\(\) must return numbers, or .* by name, got the name 1",
    RestoresBadly: r"predators: algorithm .* failed in restore\(\): KeyError: 'tems' \(test_mistakes.py, line \d+\)",
    RestoresNothing: r"predators: algorithm .*: restore\(\) must .* what state\(\) returned, .* teams differs then",
    NoOptimiser: r"predators: algorithm .*: optimiser\(\) must return an object with ask\(\) and .*, got NoneType",
}


def train(kind: type, out: Path, *more: str) -> int:
    named = ["--predators.algorithm", f"{__name__}:{kind.__name__}", "--out", str(out), "--quiet", *more]
    return main(["train", "smoke", *SMALL, *named])


@pytest.mark.parametrize(("kind", "message"), MISTAKES.items())
def test_a_mistake_is_told_in_one_line(
    kind: type, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert train(kind, tmp_path / "run") == 1
    *_, last = capsys.readouterr().err.splitlines()
    assert_told(message, last)


def assert_told(message: str, line: str) -> None:
    assert re.fullmatch(f"esp-trainer: {message}", line), line


def test_a_state_that_cannot_be_taken_on_is_no_damaged_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert train(NumbersInState, tmp_path / "run") == 0
    monkeypatch.setattr(NumbersInState, "restore", RestoresBadly.restore)
    capsys.readouterr()
    assert main(["resume", str(tmp_path / "run"), "--generations", "3"]) == 1
    *_, last = capsys.readouterr().err.splitlines()
    assert_told(r"predators: algorithm .* failed in restore\(\): KeyError: 'tems' \(test_mistakes.py, line \d+\)", last)


def test_numbers_in_a_state_come_back(tmp_path: Path) -> None:
    assert (
        train(NumbersInState, tmp_path / "run") == train(NumbersInState, tmp_path / "whole", "--generations", "4") == 0
    )
    assert main(["resume", str(tmp_path / "run"), "--generations", "4", "--quiet"]) == 0
    assert (tmp_path / "run/metrics.jsonl").read_bytes() == (tmp_path / "whole/metrics.jsonl").read_bytes()


def test_champions_are_read_without_the_state_of_an_algorithm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert train(NumbersInState, tmp_path / "run") == 0
    monkeypatch.setattr(NumbersInState, "restore", RestoresBadly.restore)
    history = History.of_run(tmp_path / "run")
    last = Team.load(tmp_path / "run" / "champions" / "predators-00001.safetensors")
    np.testing.assert_array_equal(history.team("predators", 1).genomes, last.genomes)


def test_what_ships_fails_as_it_is() -> None:
    """A fault of ours is not the user's mistake: its traceback is what helps."""
    for name in ("esp", "cosyne"):
        with pytest.raises(KeyError, match="oops"), failures_told(name, "tell()"):
            raise KeyError("oops")
    with pytest.raises(PartError, match="failed in tell"), failures_told("mine:Own", "tell()"):
        raise KeyError("oops")
    with pytest.raises(MemoryError), failures_told("mine:Own", "tell()"):
        raise MemoryError
