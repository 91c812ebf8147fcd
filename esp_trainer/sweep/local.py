"""Runs in processes of this machine."""

from __future__ import annotations

import os
import signal
import threading
import warnings
from collections import Counter, deque
from collections.abc import Sequence
from contextlib import suppress
from multiprocessing.connection import Connection, wait
from pathlib import Path
from types import FrameType
from typing import Any, NamedTuple

from esp_trainer.config import RunConfig
from esp_trainer.processes import TRIES, WorkerProcess
from esp_trainer.run.trainer import Trainer
from esp_trainer.sweep.pool import Outcome, Work
from esp_trainer.sweep.work import carry_out


class LocalPool:
    """A pool of worker processes; see :class:`~esp_trainer.sweep.pool.Pool`.

    If a worker dies, another resumes its run from the last checkpoint. However this process ends, its workers end too.
    """

    def __init__(self, runs: Sequence[Work], n_workers: int) -> None:
        self._waiting = deque(runs)
        self._lost: Counter[Path] = Counter()
        self._warned: dict[Any, Any] = {}  # shared, so that the same warning of several workers is shown once
        self._workers = [_RunWorker() for _ in range(min(n_workers, len(runs)))]

    def outcomes(self, timeout: float) -> list[Outcome]:
        """Return the runs that have ended, and give waiting runs to idle workers."""
        for worker in self._workers:
            if worker.work is None and self._waiting:
                worker.do(self._waiting.popleft())
        busy = {worker.connection: worker for worker in self._workers if worker.work}
        ready = wait(list(busy), timeout)
        ended = (self._look(worker) for connection, worker in busy.items() if connection in ready)
        return [outcome for outcome in ended if outcome]

    def _look(self, worker: _RunWorker) -> Outcome | None:
        work = worker.work
        assert work is not None
        try:
            said = worker.connection.recv()
        except (EOFError, OSError):
            return self._replace(worker, work)
        if isinstance(said, _Warned):
            warnings.warn_explicit(said.text, said.category, said.file, said.line, registry=self._warned)
            return None
        worker.work = None
        return Outcome(work.path, said)

    def _replace(self, dead: _RunWorker, work: Work) -> Outcome | None:
        self._workers[self._workers.index(dead)] = _RunWorker()
        code = dead.end()
        self._lost[work.path] += 1
        if self._lost[work.path] < TRIES:
            self._waiting.appendleft(work)
            return None
        cause = signal.Signals(-code).name if code < 0 else f"exit code {code}"
        return Outcome(work.path, f"its process was lost {TRIES} times, the last time by {cause}")

    def stop(self) -> None:
        """Stop the workers. Each ends after its current generation, with a checkpoint."""
        self._waiting.clear()
        for worker in self._workers:
            worker.process.terminate()
        for worker in self._workers:
            worker.process.join()

    def close(self) -> None:
        """Kill the workers that are left."""
        for worker in self._workers:
            worker.process.kill()
            worker.end()


class _Warned(NamedTuple):
    """A warning that a worker raised."""

    text: str
    category: type[Warning]
    file: str
    line: int


class _RunWorker(WorkerProcess):
    """A worker process, and its current run."""

    def __init__(self) -> None:
        super().__init__(_serve)
        self.work: Work | None = None

    def do(self, work: Work) -> None:
        self.work = work
        with suppress(OSError):  # a dead worker is found by the next outcomes()
            self.connection.send((work.path, work.config.model_dump()))


def _serve(connection: Connection) -> None:
    """Carry out runs in a worker, one after the other as they arrive, until it is told to stop."""
    warnings.showwarning = lambda text, *where: connection.send(_Warned(str(text), *where[:3]))
    trainers: list[Trainer] = []
    stopping = threading.Event()

    def stop(_number: int, _frame: FrameType | None) -> None:
        stopping.set()
        if not trainers:  # no run has begun, so nothing is lost
            os._exit(0)
        trainers[-1].stop()

    signal.signal(signal.SIGTERM, stop)
    while not stopping.is_set():
        try:
            path, config = connection.recv()
        except EOFError:
            return
        reason = carry_out(path, RunConfig.from_dict(config), trainers.append)
        if not stopping.is_set():
            connection.send(reason)
        trainers.clear()
