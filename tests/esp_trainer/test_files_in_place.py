"""Links, modes and names stay as they are when a file is written over, and what cannot be replaced is written to."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from esp_trainer.files import (
    check_place,
    sync_directory,
    write,
    write_table,
)
from esp_trainer.run.directory import Log

if TYPE_CHECKING:
    from collections.abc import Callable


# Links, and what cannot be replaced.


def test_a_link_stays_and_its_target_is_written(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    target, link = tmp_path / "real/table.csv", tmp_path / "table.csv"
    target.write_text("old")
    link.symlink_to("real/table.csv")
    check_place(link)
    write_table(link, [["new"]])
    assert link.is_symlink()
    assert target.read_bytes() == b"new\r\n"
    assert list((tmp_path / "real").iterdir()) == [target]


def test_a_chain_of_links_to_a_file_that_is_not_there_yet_makes_that_file(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "first").symlink_to(tmp_path / "second")
    (tmp_path / "second").symlink_to("real/file")
    check_place(tmp_path / "first")
    assert not (tmp_path / "real/file").exists()
    write(tmp_path / "first", b"new")
    assert (tmp_path / "first").is_symlink()
    assert (tmp_path / "second").is_symlink()
    assert (tmp_path / "real/file").read_bytes() == b"new"


@pytest.mark.parametrize(
    ("target", "says"),
    [("loop", "Too many levels"), (".", "Is a directory"), ("nowhere/file", "No such file"), ("loop/file", "Too many")],
)
def test_a_link_to_where_nothing_can_be_written_is_refused_and_stays(target: str, says: str, tmp_path: Path) -> None:
    (tmp_path / "loop").symlink_to("loop")
    link = tmp_path / ("loop" if target == "loop" else "link")
    if target != "loop":
        link.symlink_to(target)
    before = sorted(tmp_path.iterdir())
    for put in (check_place, lambda path: write(path, b"new")):
        with pytest.raises(OSError, match=says) as refused:
            put(link)
        assert refused.value.filename == str(link)
    assert sorted(tmp_path.iterdir()) == before
    assert link.is_symlink()


def test_a_file_that_is_written_over_keeps_its_mode(tmp_path: Path) -> None:
    path = tmp_path / "file"
    for mode in (0o600, 0o664):
        path.write_bytes(b"old")
        path.chmod(mode)
        write(path, b"new")
        assert path.read_bytes() == b"new"
        assert path.stat().st_mode & 0o777 == mode


@pytest.mark.parametrize("number", [errno.ENOSYS, errno.EOPNOTSUPP, errno.EPERM, errno.EACCES])
def test_a_file_whose_mode_cannot_be_kept_is_replaced_all_the_same(
    number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not written over in place, where a kill would cost the old one."""
    path, link = tmp_path / "file", tmp_path / "old"
    path.write_bytes(b"old")
    link.hardlink_to(path)
    monkeypatch.setattr(os, "chmod", _refuse(number))
    write(path, b"new")
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == {"file": b"new", "old": b"old"}


# Systems that do not sync.


@pytest.mark.parametrize("number", [errno.ENOSYS, errno.EINVAL, errno.EBADF, errno.EOPNOTSUPP])
def test_where_the_system_cannot_sync_everything_is_written_all_the_same(
    number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "fsync", _refuse(number))
    write(tmp_path / "file", b"new")
    sync_directory(tmp_path)
    log = Log(tmp_path / "log")
    log.append({"generation": 0})
    log.sync()
    log.close()
    found = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    assert found == {"file": b"new", "log": b'{"generation": 0}\n'}


def test_a_directory_whose_disk_fails_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "fsync", _refuse(errno.EIO))
    for directory in (tmp_path, tmp_path / "nowhere"):
        with pytest.raises(OSError, match=str(directory)):
            sync_directory(directory)


def _refuse(number: int) -> Callable[..., None]:
    """Make a function that the system refuses with this error."""

    def fail(*_: Any, **__: Any) -> None:
        raise OSError(number, os.strerror(number))

    return fail


def test_a_file_that_cannot_be_replaced_is_written_to(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is mounted by itself, say, or its directory is not ours."""
    path = tmp_path / "file"
    path.write_bytes(b"something older")
    inode = path.stat().st_ino

    def busy(path: Path, target: Path) -> Path:
        raise OSError(errno.EBUSY, "Device or resource busy")

    monkeypatch.setattr(Path, "replace", busy)
    write(path, b"new")
    assert path.read_bytes() == b"new"
    assert path.stat().st_ino == inode
    assert list(tmp_path.iterdir()) == [path]


def test_a_name_as_long_as_can_be_is_written(tmp_path: Path) -> None:
    path = tmp_path / ("x" * 255)
    check_place(path)
    write(path, b"new")
    assert {file: file.read_bytes() for file in tmp_path.iterdir()} == {path: b"new"}


def test_a_file_that_standard_output_goes_to_keeps_what_is_printed(tmp_path: Path) -> None:
    # Not /dev/stdout, as a superuser's test could replace it. In this directory nobody can make a file.
    code = """
from pathlib import Path
from esp_trainer.files import write
print("before")
write(Path("/proc/self/fd/1"), b"table\\n")
print("after")
"""
    with (tmp_path / "file").open("wb") as file:
        subprocess.run([sys.executable, "-c", code], stdout=file, check=True)
    assert (tmp_path / "file").read_bytes() == b"before\ntable\nafter\n"


def test_a_table_holds_a_path_that_is_no_text(tmp_path: Path) -> None:
    write_table(tmp_path / "table.csv", [[Path(os.fsdecode(b"run-\xff"))]])
    assert (tmp_path / "table.csv").read_bytes() == b"run-\\udcff\r\n"
