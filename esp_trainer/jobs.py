"""Independent jobs, spread over processes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from typing import Any

from tqdm import tqdm


def in_processes(work: Callable[..., object], jobs: Sequence[tuple[Any, ...]], n_workers: int, what: str) -> None:
    """Call a function with the arguments of each job, in several processes, and show the progress.

    The first job that fails ends the call with its error; jobs that have not begun are then dropped.

    Args:
        work: A function that a new process can import.
        jobs: Arguments of each call.
        n_workers: Number of processes.
        what: What they do, for the progress bar.
    """
    if not jobs:
        return
    with ProcessPoolExecutor(n_workers, get_context("spawn")) as pool:
        running = [pool.submit(work, *job) for job in jobs]
        try:
            for job in tqdm(as_completed(running), total=len(running), desc=what, unit="run"):
                job.result()
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
