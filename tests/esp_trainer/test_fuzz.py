"""Damaged and hostile files at every reader: each is refused in one line, or read as what it was; nothing else happens.

What is not refused must be the original, but for a config and a log, which are text for people too: a changed digit
there is another config, and is compared with the checkpoint's when the run goes on.
"""

from __future__ import annotations

import json
import pickle
import resource
import shutil
import struct
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from safetensors.numpy import save

from esp_trainer.analysis.history import History
from esp_trainer.cli import main
from esp_trainer.esp.team import Team
from esp_trainer.report import source
from esp_trainer.run.checkpoint import load_checkpoint
from esp_trainer.run.directory import RunDirectory

GENERATIONS = 3


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small run, not to be changed."""
    place = tmp_path_factory.mktemp("runs") / "run"
    options = [
        "--predators.n_hidden",
        "2",
        "--prey.n_hidden",
        "2",
        "--esp.subpopulation_size",
        "8",
        "--esp.hof_mates",
        "1",
    ]
    assert main(["train", "smoke", *options, "--generations", str(GENERATIONS), "--out", str(place), "--quiet"]) == 0
    return place


def read_team(path: Path) -> bytes:
    team = Team.load(path)
    return team.genomes.tobytes() + json.dumps([team.role, dict(team.provenance)], sort_keys=True).encode()


def read_checkpoint(path: Path) -> bytes:
    sides, done = load_checkpoint(path, RunDirectory(path.parent).read_config())
    genomes = [side.algorithm.genomes.tobytes() for side in sides.values()]  # type: ignore[union-attr]
    return b"".join([*genomes, str(done).encode()])


def read_config(path: Path) -> bytes:
    return RunDirectory(path.parent).read_config().model_dump_json().encode()


def read_log(path: Path) -> bytes:
    return b"".join(curve.tobytes() for curve in History.of_run(path.parent).curves.values())


READERS: dict[str, Callable[[Path], bytes]] = {
    "champions/prey-00002.safetensors": read_team,
    "checkpoint.safetensors": read_checkpoint,
    "config.json": read_config,
    "metrics.jsonl": read_log,
}
TEXT = ("config.json", "metrics.jsonl")


@pytest.fixture
def place(run: Path, tmp_path: Path) -> Path:
    """A copy of the run, to be damaged."""
    return Path(shutil.copytree(run, tmp_path / "run"))


def outcome(read: Callable[[Path], bytes], file: Path) -> bytes | None:
    """What is read, or None if it is refused, in one line."""
    try:
        return read(file)
    except (ValueError, FileNotFoundError) as error:
        line = str(error)
    assert line
    assert len(line.splitlines()) == 1, line
    return None


def damaged(data: bytes, kind: str) -> Iterator[bytes]:
    if kind == "cut off":
        yield from (data[:length] for length in range(len(data)))
        return
    generator = np.random.default_rng(0)
    for _ in range(1000):
        changed = bytearray(data)
        for bit in generator.integers(0, 8 * len(data), generator.integers(1, 4)).tolist():
            changed[bit // 8] ^= 1 << bit % 8
        yield bytes(changed)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["cut off", "bits flipped"])
@pytest.mark.parametrize("name", READERS)
def test_what_is_damaged_is_refused_or_read_as_it_was(name: str, kind: str, place: Path) -> None:
    file, read = place / name, READERS[name]
    whole = file.read_bytes()
    expected, refused, cases = read(file), 0, 0
    for data in damaged(whole, kind):
        file.write_bytes(data)
        found = outcome(read, file)
        cases += 1
        refused += found is None
        if found is not None and name not in TEXT:
            assert found == expected
    assert cases >= 1000
    assert refused > cases / 3 if name in TEXT else refused >= 0.99 * cases


@pytest.mark.slow
@pytest.mark.parametrize("name", [*READERS, "timing.jsonl"])
def test_a_page_is_about_what_is_whole(name: str, place: Path) -> None:
    file = place / name
    whole = file.read_bytes()
    for data in islice(damaged(whole, "bits flipped"), 200):
        file.write_bytes(data)
        found = outcome(read_source, file)
        assert found is not None or name == "config.json"


def read_source(file: Path) -> bytes:
    run = file.parent.parent if file.parent.name == "champions" else file.parent
    return str(source.read_source(run).missing).encode()


def foreign() -> dict[str, bytes]:
    """Files that are something else, or pretend to be absurdly large."""
    header = {"x": {"dtype": "F32", "shape": [2**40, 2**20], "data_offsets": [0, 2**62]}}
    absurd = json.dumps(header).encode()
    negative = json.dumps({"x": {"dtype": "F32", "shape": [-1], "data_offsets": [0, 4]}}).encode()
    deep = b"[" * 200_000 + b"]" * 200_000
    return {
        "nothing": b"",
        "zeros": bytes(4096),
        "a foreign safetensors": save({"x": np.zeros(4, np.float32)}),
        "metadata of others": save({"x": np.zeros(4, np.float32)}, metadata={"esp_trainer": "7"}),
        "no digest": save({"x": np.zeros(4, np.float32)}, metadata={"esp_trainer": '{"kind": "team", "schema": 1}'}),
        "deep metadata": save({"x": np.zeros(4, np.float32)}, metadata={"esp_trainer": deep.decode()}),
        "a header of 2**63 bytes": struct.pack("<Q", 2**63) + b"{}",
        "a header of a terabyte": struct.pack("<Q", 2**40) + b"{}",
        "absurd shapes": struct.pack("<Q", len(absurd)) + absurd,
        "negative shapes": struct.pack("<Q", len(negative)) + negative + bytes(4),
        "deep nesting": deep,
        "a long number": b"1" * 1_000_000,
        "a huge string": b'{"schema": 1, "config": "' + b"a" * 20_000_000 + b'"}',
        "an unknown world": b'{"schema": 1, "config": {"env": {"size": 1e308}}}',
        "not a number": b'{"schema": 1, "config": {"seed": NaN}}',
        "other text": "ä".encode("latin-1") * 100,
        "a pickle": pickle.dumps(Explosive()),
    }


class Explosive:
    """A file of this must not be unpickled."""

    def __reduce__(self) -> Any:
        return (exploded, ())


def exploded() -> None:
    raise SystemExit("a file was executed")


@pytest.mark.parametrize("what", foreign())
@pytest.mark.parametrize("name", READERS)
def test_what_is_something_else_is_refused_without_much_memory(name: str, what: str, place: Path) -> None:
    file = place / name
    file.write_bytes(foreign()[what])
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert outcome(READERS[name], file) is None
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 500_000  # kilobytes


def test_files_in_each_others_places_are_refused(place: Path) -> None:
    names = list(READERS)
    contents = {name: (place / name).read_bytes() for name in names}
    for name in names:
        for other in names:
            if name != other:
                (place / name).write_bytes(contents[other])
                assert outcome(READERS[name], place / name) is None, (name, other)
                (place / name).write_bytes(contents[name])
    prey = place / "champions/prey-00002.safetensors"
    shutil.copy(place / "champions/predators-00002.safetensors", prey)
    assert Team.load(prey).role == "predators"  # a team says itself what it is, whatever its file is called
