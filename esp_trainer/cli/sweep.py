"""``sweep``: many runs in parallel, with their progress on the terminal."""

from __future__ import annotations

import json
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from types import FrameType

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from esp_trainer.cli.signals import handled_by
from esp_trainer.cli.streams import is_screen, let_go, say
from esp_trainer.cli.training import quoted
from esp_trainer.cluster import check_ray_installed, connected
from esp_trainer.cores import cores
from esp_trainer.files import write
from esp_trainer.run.directory import RunDirectory, Tail
from esp_trainer.run.lock import Lock
from esp_trainer.sweep.local import LocalPool
from esp_trainer.sweep.on_cluster import ClusterPool
from esp_trainer.sweep.plan import PlannedRun, plan_of
from esp_trainer.sweep.pool import Pool, Work
from esp_trainer.sweep.results import RunResult, is_whole, result_of, sweep_table, write_csv
from predprey_env.settings import counted

_LOOK = 0.25  # seconds between checks of the runs


def sweep(file: Path, out: Path | None, workers: int | None, address: str | None, *, quiet: bool) -> int:
    """Run all runs of a sweep that are not complete, and print the results."""
    if address:
        check_ray_installed()
    declared = file.read_bytes()  # only once, because it may be a pipe
    plan = plan_of(declared, file)
    out = out or _place(file)
    if RunDirectory(out).config_file.exists():
        raise FileExistsError(f"{out} holds a run; choose another directory for a sweep")
    out.mkdir(parents=True, exist_ok=True)
    held = Lock(out)
    try:
        write(out / "sweep.toml", declared)
        todo = [run for run in plan if not is_whole(out / run.name, run)]
        say(
            f"{counted(len(plan), 'run')} in {out}"
            + (f", {len(plan) - len(todo)} of them complete" if len(todo) < len(plan) else "")
        )
        failed, stopped_by = _do(todo, out, workers, address, quiet=quiet) if todo else ({}, 0)
        results = [result_of(out / run.name, run, failed.get(run.name)) for run in plan]
        write_csv(out / "runs.csv", results)  # before printing, which fails if the terminal is closed
    finally:
        held.release()
    if not stopped_by:
        _tell(results, out)
        return 1 if any(result.reason for result in results) else 0
    with suppress(OSError):  # for example, the terminal is closed
        _tell(results, out)
    let_go(sys.stdout)
    where = [f"--address {address}"] if address else [f"--workers {workers}"] if workers else []
    again = file if _has_name(file) else out / "sweep.toml"
    command = " ".join(["esp-trainer sweep", quoted(again), "--out", quoted(out), *where])
    say(f"stopped; go on with: {command}")
    return 128 + stopped_by


def _place(file: Path) -> Path:
    """Return the default directory of a sweep, named after its file."""
    if not _has_name(file):
        raise ValueError(f"{file} has no name of its own for the directory of the runs: give it by --out")
    return Path("runs") / file.stem


def _has_name(file: Path) -> bool:
    """Return whether a path is a regular file with a name, not a pipe or an open file by its descriptor."""
    return file.is_file() and str(file.parent) not in ("/dev", "/dev/fd", "/proc/self/fd")


def _do(
    todo: Sequence[PlannedRun], out: Path, workers: int | None, address: str | None, *, quiet: bool
) -> tuple[dict[str, str], int]:
    """Run the runs; return the reasons of failed runs by name, and the signal that stopped the sweep or 0."""
    failed: dict[str, str] = {}
    runs, heard = {run.name: run for run in todo}, list[int]()

    def interrupt(number: int, _frame: FrameType | None) -> None:
        heard.append(number)
        later = heard[1:]
        # The first signal stops the sweep, and Ctrl-C after it stops at once. Other later signals are ignored, because
        # a terminal that closes sends more than one.
        if not later or (number == signal.SIGINT and later.count(number) == 1):
            raise KeyboardInterrupt

    work = [Work(out / run.name, run.config) for run in todo]
    with connected(address) if address else nullcontext(), handled_by(interrupt):
        pool: Pool = ClusterPool(work) if address else LocalPool(work, workers or cores())
        try:
            with _view(todo, out, quiet=quiet) as look:
                left = len(todo)
                while left:
                    for path, outcome in pool.outcomes(_LOOK):
                        left -= 1
                        reason = outcome
                        if not reason and not is_whole(path, runs[path.name]):
                            reason = f"its log, its champions or its checkpoint are not all in {path}"
                        if reason:
                            failed[path.name] = reason
                        look(path.name, reason)
                    look(None, None)
        except KeyboardInterrupt:
            with suppress(KeyboardInterrupt):
                say("stopping after the generations in hand; Ctrl-C now stops at once")
                pool.stop()
            return failed, next(iter(heard), signal.SIGINT)
        finally:
            pool.close()
    return failed, 0


Look = Callable[[str | None, str | None], None]
"""Function called with the name of a run that has ended and the reason if it failed, or with None for both to show the
progress of the others."""


@contextmanager
def _view(todo: Sequence[PlannedRun], out: Path, *, quiet: bool) -> Iterator[Look]:
    if quiet or not is_screen(sys.stderr):
        yield _Lines(todo, out)
        return
    console = Console(stderr=True)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(bar_width=20),
        MofNCompleteColumn(),
        TextColumn("{task.fields[caught]}"),
        TimeRemainingColumn(compact=True),
    )
    with Progress(*columns, console=console) as progress:
        yield _Bars(todo, out, progress)


class _Lines:
    """A view that prints a line for each run that ends."""

    def __init__(self, todo: Sequence[PlannedRun], out: Path) -> None:
        self._runs = {run.name: run for run in todo}
        self._out, self._ended = out, 0

    def __call__(self, name: str | None, reason: str | None) -> None:
        if name is None:
            return
        self._ended += 1
        result = result_of(self._out / name, self._runs[name], reason)
        say(f"[{self._ended}/{len(self._runs)}] {_line(result)}")


class _Bars:
    """A view with a progress bar for each run in progress, and one for the whole sweep."""

    def __init__(self, todo: Sequence[PlannedRun], out: Path, progress: Progress) -> None:
        self._runs = {run.name: run for run in todo}
        self._out, self._progress, self._ended = out, progress, 0
        self._tails = {run.name: Tail(RunDirectory(out / run.name).metrics_file) for run in todo}
        self._done = dict.fromkeys(self._tails, 0)
        self._last = dict.fromkeys(self._tails, b"")
        self._bars: dict[str, TaskID] = {}
        self._all = progress.add_task("", total=sum(run.config.generations for run in todo), caught="")
        for name in self._tails:  # generations from before an interruption
            self._done[name] = len(self._look(name)[0])
        progress.update(self._all, completed=sum(self._done.values()))

    def __call__(self, name: str | None, reason: str | None) -> None:
        for each in self._tails:
            lines, cut = self._look(each)
            if lines or cut:
                self._done[each] = len(lines) + (0 if cut else self._done[each])
                self._last[each] = lines[-1] if lines else self._last[each]
                self._show(each)
        if name is not None:
            self._ended += 1
            self._tails.pop(name)
            if name in self._bars:
                self._progress.remove_task(self._bars.pop(name))
            self._progress.console.print(_line(result_of(self._out / name, self._runs[name], reason)), highlight=False)
        ended = f"{self._ended} of {counted(len(self._runs), 'run')}"
        self._progress.update(self._all, completed=sum(self._done.values()), description=ended)

    def _look(self, name: str) -> tuple[list[bytes], bool]:
        try:
            return self._tails[name].look()
        except OSError:  # the run's worker will report the error
            return [], False

    def _show(self, name: str) -> None:
        if name not in self._bars:
            self._bars[name] = self._progress.add_task(name, total=self._runs[name].config.generations, caught="")
        try:
            held_out = json.loads(self._last[name])["held_out"]
            payoff = "caught" if "caught" in held_out else "payoff"
            caught = f"{payoff} {held_out[payoff]['rate']:z.2f}"
        except (ValueError, TypeError, KeyError):
            caught = ""
        self._progress.update(self._bars[name], completed=self._done[name], caught=caught)


def _line(result: RunResult) -> str:
    if result.reason:
        return f"{result.run.name}: failed: {result.reason}"
    success = (
        f"{result.figures['caught']:.2f} of the prey caught"
        if "caught" in result.figures
        else f"payoff {result.figures['payoff']:z.2f}"
    )
    return f"{result.run.name}: {counted(result.generations, 'generation')}, {success}"


def _tell(results: Sequence[RunResult], out: Path) -> None:
    print("\n".join(sweep_table(results)))
    failed = [result for result in results if result.reason]
    for result in failed:
        print(f"failed: {result.run.name}: {result.reason}")
    print(f"  every run     {out / 'runs.csv'}")
    cells = dict.fromkeys(result.run.cell for result in results if result.whole)
    if cells:
        print(f"next:\n  esp-trainer report {quoted(out / next(iter(cells)))}-seed*")
    if len(cells) > 1:
        print(f"  esp-trainer compare {quoted(out)}")
