"""Processes that work on jobs, and are replaced when they die."""

from __future__ import annotations

import signal
from collections import Counter, deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection, wait
from typing import Any, NamedTuple, TypeAlias

from esp_trainer.processes import TRIES, WorkerProcess

_UNGUARDED = "; a script that starts processes must do so below if __name__ == '__main__'"

JobFunction: TypeAlias = Callable[[Any], Any]
"""Function that a process calls for each job; it must be importable there."""


class WorkError(ValueError):
    """A job failed. The message is one line."""


class _Failed(NamedTuple):
    why: str


class Workers:
    """Processes that call a function on jobs. They start with the first jobs, and end with this process.

    Args:
        work: The function.
        n: Number of processes.
    """

    def __init__(self, work: JobFunction, n: int) -> None:
        self._work, self.n = work, n
        self._workers: list[_JobWorker] = []

    def map(self, jobs: Sequence[Any]) -> list[Any]:
        """Return the result of each job, in order.

        The job of a process that dies is given to another one.

        Raises:
            WorkError: The function failed, or a job's process died :data:`TRIES` times.
        """
        while len(self._workers) < min(self.n, len(jobs)):
            self._workers.append(_JobWorker(self._work))
        results: dict[int, Any] = {}
        waiting, lost = deque(range(len(jobs))), Counter[int]()
        try:
            while len(results) < len(jobs):
                for worker in self._workers:
                    if worker.job is None and waiting:
                        worker.do(waiting.popleft(), jobs)
                busy = {worker.connection: worker for worker in self._workers if worker.job is not None}
                for connection in wait(list(busy)):
                    worker = busy[connection]  # type: ignore[index]  # wait() returns what it was given
                    job, worker.job = worker.job, None
                    assert job is not None
                    try:
                        said = worker.connection.recv()
                    except (EOFError, OSError):
                        waiting.appendleft(job)
                        lost[job] += 1
                        self._replace(worker, lost[job])
                        continue
                    if isinstance(said, _Failed):
                        raise WorkError(said.why)
                    results[job] = said
        except BaseException:  # Ctrl-C included: the results of the other jobs are no longer needed
            self.close()
            raise
        return [results[job] for job in range(len(jobs))]

    def _replace(self, dead: _JobWorker, times: int) -> None:
        code = dead.end()
        if times == TRIES:
            cause = signal.Signals(-code).name if code < 0 else f"exit code {code}{_UNGUARDED}"
            raise WorkError(f"the process of a job was lost {TRIES} times, the last time by {cause}")
        self._workers[self._workers.index(dead)] = _JobWorker(self._work)

    def close(self) -> None:
        """Kill the processes. Further jobs start new ones."""
        for worker in self._workers:
            worker.process.kill()
            worker.end()
        self._workers.clear()

    def __getstate__(self) -> dict[str, Any]:
        """Leave the processes out of copies and pickles."""
        return self.__dict__ | {"_workers": []}


class _JobWorker(WorkerProcess):
    def __init__(self, work: JobFunction) -> None:
        super().__init__(_serve, work)
        self.job: int | None = None

    def do(self, number: int, jobs: Sequence[Any]) -> None:
        self.job = number
        with suppress(OSError):  # map() finds a dead process when it reads its answer
            self.connection.send(jobs[number])


def _serve(connection: Connection, work: JobFunction) -> None:
    with suppress(EOFError, OSError):
        while True:
            job = connection.recv()
            try:
                said = work(job)
            except Exception as error:
                line = str(error) if isinstance(error, ValueError) else f"{type(error).__name__}: {error}"
                said = _Failed(" ".join(line.split()))
            connection.send(said)
