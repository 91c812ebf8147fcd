"""The command line in this process, and a few small runs to use it on."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import pytest

from esp_trainer.cli import main

if TYPE_CHECKING:
    from collections.abc import Callable


class Outcome(NamedTuple):
    """What a command came to."""

    code: int
    out: str
    err: str

    @property
    def refusal(self) -> str:
        """The one line that says what is wrong, of a command that failed."""
        assert self.code != 0, self
        assert self.out == "", self
        lines = self.err.splitlines()
        assert len(lines) == 1, self
        return lines[0]


@pytest.fixture(autouse=True)
def _somewhere_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs go to ``runs/`` below the current directory, unless they are told otherwise."""
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def esp_trainer(capsys: pytest.CaptureFixture[str]) -> Callable[..., Outcome]:
    """``esp_trainer("train", "smoke", ...)``: run a command in this process."""

    def run(*arguments: object) -> Outcome:
        capsys.readouterr()
        try:
            code = main([str(argument) for argument in arguments])
        except SystemExit as end:  # argparse's way
            code = end.code if isinstance(end.code, int) else 1
        except KeyboardInterrupt:
            pytest.fail("the interrupt was not caught, and would end in a traceback")
        return Outcome(code, *capsys.readouterr())

    return run


class Contents(dict[str, bytes]):
    """Every file below a directory; a directory has no bytes."""

    def __init__(self, path: Path) -> None:
        below = sorted(path.rglob("*"))
        super().__init__({str(file): file.read_bytes() if file.is_file() else b"" for file in below})


@pytest.fixture(scope="session")
def contents() -> type[Contents]:
    """``contents(path)``: the bytes of everything below a directory, to compare with what is there later."""
    return Contents


def _train(path: Path, *options: str) -> Path:
    code = main(["train", "smoke", "--out", str(path), "--quiet", *options])
    assert code == 0
    return path


@pytest.fixture(scope="session")
def smoke_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A complete run of twenty generations, not to be changed."""
    return _train(tmp_path_factory.mktemp("runs") / "smoke")


@pytest.fixture(scope="session")
def predators(smoke_run: Path) -> Path:
    """Three predators that evolved against two prey."""
    return smoke_run / "champions/predators-00019.safetensors"


@pytest.fixture(scope="session")
def prey(smoke_run: Path) -> Path:
    """Two prey that evolved against three predators."""
    return smoke_run / "champions/prey-00019.safetensors"


@pytest.fixture(scope="session")
def three_prey_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run with three prey, not to be changed."""
    return _train(tmp_path_factory.mktemp("runs") / "three", "--env.n_prey", "3", "--generations", "1")


@pytest.fixture(scope="session")
def four_predators_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run with four predators, not to be changed."""
    return _train(tmp_path_factory.mktemp("runs") / "four", "--env.n_predators", "4", "--generations", "1")
