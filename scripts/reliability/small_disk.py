"""A disk of some pages: a tmpfs, filled until only so many are left. Takes the right to mount."""

from __future__ import annotations

import mmap
import os
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

PAGE = mmap.PAGESIZE
_PATIENCE = 50  # tenths of a second
_FILLER = ".filler"  # and, where names are to run out, a directory of empty files


def refused() -> str:
    """Why no disk can be mounted here; empty if one can."""
    with TemporaryDirectory() as place:
        try:
            _run("mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", place)
        except (OSError, subprocess.CalledProcessError) as error:
            said = getattr(error, "stderr", "") or str(error)
            return said.strip().splitlines()[-1]
        _run("umount", place)
    return ""


class SmallDisk:
    """A mounted disk."""

    def __init__(self, place: Path) -> None:
        self.place = place
        self._filler = place / _FILLER

    def leave_pages(self, n: int) -> None:
        """Fill it until so many pages are left."""
        free = os.statvfs(self.place).f_bavail - n
        with self._filler.open("wb") as filler:
            for _ in range(free):
                filler.write(bytes(PAGE))

    def leave_names(self, n: int) -> None:
        """Fill it until it takes so many more files or directories."""
        self._filler.mkdir()
        for number in range(os.statvfs(self.place).f_ffree - n):
            (self._filler / str(number)).touch()

    def seal(self) -> None:
        """Let nobody write to it."""
        _run("mount", "-o", "remount,ro", str(self.place))

    def make_room(self) -> None:
        """Take away what fills or seals it."""
        if os.statvfs(self.place).f_flag & os.ST_RDONLY:
            _run("mount", "-o", "remount,rw", str(self.place))
        elif self._filler.is_dir():
            shutil.rmtree(self._filler)
        else:
            self._filler.unlink()


@contextmanager
def small_disk(pages: int, names: int = 1000) -> Iterator[SmallDisk]:
    """A disk with room for so many pages, files and directories."""
    with TemporaryDirectory() as place:
        _run("mount", "-t", "tmpfs", "-o", f"size={pages * PAGE},nr_inodes={names}", "tmpfs", place)
        try:
            yield SmallDisk(Path(place))
        finally:
            _unmount(place)


def _unmount(place: str) -> None:
    """Python's watchers of workers outlive their parent by a moment, and stand there."""
    for _ in range(_PATIENCE):
        if subprocess.run(["umount", place], capture_output=True, check=False).returncode == 0:
            return
        time.sleep(0.1)
    _run("umount", place)


def _run(*command: str) -> None:
    subprocess.run(command, check=True, capture_output=True, text=True)
