"""Files are written whole or not at all."""

from __future__ import annotations

import errno
import os
import subprocess
from pathlib import Path
from typing import Any

import disk
import numpy as np
import pytest

from esp_trainer.files import (
    check_place,
    to_json,
    write,
    write_arrays,
    write_table,
)

# Writing.


def test_a_file_is_written_and_written_over(tmp_path: Path) -> None:
    for data in (b"old", b"", b"newer and longer"):
        write(tmp_path / "file", data)
        assert (tmp_path / "file").read_bytes() == data
        assert [file.name for file in tmp_path.iterdir()] == ["file"]


def test_a_file_is_whole_and_synced_before_it_is_renamed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    order: list[str] = []
    disk.spy(
        monkeypatch,
        lambda path: order.append(f"sync {path.name}"),
        lambda path, target: order.append(f"rename {target.name}, {path.read_bytes().decode()}"),
    )
    write(tmp_path / "file", b"whole")
    assert order[:2] == ["sync .file.part", "rename file, whole"]


@pytest.mark.parametrize("step", ["fsync", "replace"])
@pytest.mark.parametrize("old", [None, b"old"], ids=["new", "old"])
def test_a_write_that_fails_leaves_what_was_there_and_nothing_else(
    step: str, old: bytes | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: Any) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    if old is not None:
        (tmp_path / "file").write_bytes(old)
    monkeypatch.setattr(*((os, "fsync") if step == "fsync" else (Path, "replace")), fail)
    with pytest.raises(OSError, match="No space left on device"):
        write(tmp_path / "file", b"new")
    with pytest.raises(OSError, match="No space left on device"):
        write_arrays(tmp_path / "file", "thing", {}, {"zeros": np.zeros(3)})
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == ({} if old is None else {"file": old})


@pytest.mark.parametrize("length", [4096, 40_000])
def test_a_write_to_a_full_disk_leaves_what_was_there_and_nothing_else(length: int, tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=8k", "tmpfs", str(disk)]
    try:
        permitted = subprocess.run(command, capture_output=True, check=False).returncode == 0
    except FileNotFoundError:
        permitted = False
    if not permitted:
        pytest.skip("this system does not let us mount a file system")
    try:
        write(disk / "file", b"o" * 4096)
        (disk / "other").write_bytes(b"x")  # the second and last page
        with pytest.raises(OSError, match="No space left on device"):
            write(disk / "file", b"n" * length)
        assert {file.name: file.read_bytes() for file in disk.iterdir()} == {"file": b"o" * 4096, "other": b"x"}
    finally:
        subprocess.run(["umount", str(disk)], check=True)


def test_a_full_disk_is_told_with_the_name_of_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Python names no file when a write or a sync fails."""

    def fail(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(OSError, match="No space left on device") as failed:
        write(tmp_path / "file", b"new")
    assert str(tmp_path / "file") in str(failed.value)


def test_a_write_that_is_interrupted_leaves_what_was_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(_: int) -> None:
        raise KeyboardInterrupt

    (tmp_path / "file").write_bytes(b"old")
    monkeypatch.setattr(os, "fsync", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write(tmp_path / "file", b"new")
    assert (tmp_path / "file").read_bytes() == b"old"
    assert [file.name for file in tmp_path.iterdir()] == ["file"]


def test_a_write_over_a_directory_or_into_none_is_refused(tmp_path: Path) -> None:
    (tmp_path / "directory").mkdir()
    (tmp_path / "file").write_bytes(b"old")
    for path in (tmp_path / "directory", tmp_path / "nowhere/file", tmp_path / "file/below"):
        with pytest.raises(OSError, match="directory"):
            write(path, b"new")
    assert sorted(file.name for file in tmp_path.rglob("*")) == ["directory", "file"]


def test_what_is_no_file_is_written_to_and_stays_what_it_is(tmp_path: Path) -> None:
    """``--csv /dev/stdout``, say; and a superuser's /dev/null must not become a file."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        write(pipe, b"hello")
        assert os.read(reader, 100) == b"hello"
    finally:
        os.close(reader)
    assert pipe.is_fifo()
    assert list(tmp_path.iterdir()) == [pipe]


def test_a_table_is_written_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "table.csv"
    write_table(path, [["name", "rate"], ['a, "b"', 0.5]])
    assert path.read_bytes() == b'name,rate\r\n"a, ""b""",0.5\r\n'
    monkeypatch.setattr(os, "fsync", _no_space)
    with pytest.raises(OSError, match="No space left on device"):
        write_table(path, [["name", "rate"]])
    assert path.read_bytes().startswith(b'name,rate\r\n"a')
    assert list(tmp_path.iterdir()) == [path]


def test_a_place_is_looked_at_without_a_trace(tmp_path: Path) -> None:
    old = tmp_path / "old"
    old.write_text("older")
    for path in (old, tmp_path / "new"):
        check_place(path)
    assert list(tmp_path.iterdir()) == [old]
    assert old.read_text() == "older"
    for path in (tmp_path, tmp_path / "nowhere/new", old / "new"):
        with pytest.raises(OSError, match=str(path)):
            check_place(path)


def test_a_pipe_is_looked_at_without_an_end_for_its_reader(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    opened: list[Path] = []
    with monkeypatch.context() as watched:
        watched.setattr(Path, "open", lambda path, *_: opened.append(path) or os.fdopen(os.dup(1)))
        for path in (pipe, Path(os.devnull)):
            check_place(path)
        assert opened == []
        watched.setattr(os, "access", lambda *_: False)
        with pytest.raises(PermissionError, match=str(pipe)):
            check_place(pipe)


def _no_space(_: int) -> None:
    raise OSError(errno.ENOSPC, "No space left on device")


def test_a_write_takes_over_what_an_earlier_death_left(tmp_path: Path) -> None:
    (tmp_path / ".file.part").write_bytes(b"a longer half of something")
    write(tmp_path / "file", b"new")
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == {"file": b"new"}


def test_json_is_the_same_for_equal_values_and_never_nan() -> None:
    assert to_json({"a": 1.0, "b": [None, True]}) == b'{\n  "a": 1.0,\n  "b": [\n    null,\n    true\n  ]\n}\n'
    for value in (float("nan"), float("inf")):
        with pytest.raises(ValueError, match="JSON"):
            to_json({"a": value})
