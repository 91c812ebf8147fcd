"""The trainer in processes of its own: run to the end, or killed, and what it said."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryFile

TRAINER = [sys.executable, "-m", "esp_trainer"]


@dataclass(frozen=True)
class Ended:
    """How a process ended."""

    code: int
    said: str
    """On standard error."""

    @property
    def errors(self) -> list[str]:
        """The lines with which it gave up."""
        return [line for line in self.said.splitlines() if line.startswith("esp-trainer: ")]

    @property
    def excuse(self) -> str:
        """Empty if it gave up as it should, in one line; else what is wrong with what it said."""
        if self.code <= 0:
            return f"ended with {self.code}"
        if "Traceback" in self.said or len(self.errors) != 1 or not self.said.endswith(f"{self.errors[0]}\n"):
            return f"said {self.said!r}"
        return ""


class Process:
    """A command of the trainer at work. What it says goes to a file: a pipe would stay open as long as its workers."""

    def __init__(self, arguments: Sequence[object], where: Path, environment: Mapping[str, str] | None = None) -> None:
        self._said = TemporaryFile("w+")  # noqa: SIM115  # closed with the process
        self.process = subprocess.Popen(
            [*TRAINER, *map(str, arguments)],
            cwd=where,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=self._said,
            env={**os.environ, **(environment or {})},
        )

    def wait(self, seconds: float | None = None) -> bool:
        """Whether it has ended after so long."""
        try:
            self.process.wait(seconds)
        except subprocess.TimeoutExpired:
            return False
        return True

    def ended(self) -> Ended:
        """Wait for it, and listen."""
        code = self.process.wait()
        self._said.seek(0)
        return Ended(code, self._said.read())

    def workers(self) -> list[int]:
        """The ids of those that it has at work."""
        pids = [int(entry.name) for entry in Path("/proc").iterdir() if entry.name.isdecimal()]
        return [pid for pid in pids if _parent(pid) == self.process.pid and b"spawn_main" in _command(pid)]

    def kill(self) -> None:
        """Let it die at once; one that has ended stays as it is."""
        self.process.kill()

    def close(self) -> None:
        """See to it that it is gone."""
        self.kill()
        self.process.wait()
        self._said.close()


def _parent(pid: int) -> int:
    try:
        return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])
    except (FileNotFoundError, ProcessLookupError):
        return 0


def _command(pid: int) -> bytes:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    except (FileNotFoundError, ProcessLookupError):
        return b""


def alive(pid: int) -> bool:
    """Whether there is such a process, and it has not ended."""
    return bool(_command(pid))


@contextmanager
def begun(arguments: Sequence[object], where: Path, environment: Mapping[str, str] | None = None) -> Iterator[Process]:
    """A command at work, killed at the end at the latest."""
    process = Process(arguments, where, environment)
    try:
        yield process
    finally:
        process.close()


def finished(arguments: Sequence[object], where: Path, environment: Mapping[str, str] | None = None) -> Ended:
    """A command that nobody stops."""
    with begun(arguments, where, environment) as process:
        return process.ended()


def succeeded(arguments: Sequence[object], where: Path) -> Ended:
    """The same; :class:`RuntimeError` with what it said if it fails."""
    ended = finished(arguments, where)
    if ended.code:
        raise RuntimeError(f"{' '.join(map(str, arguments))} ended with {ended.code}: {ended.said}")
    return ended
