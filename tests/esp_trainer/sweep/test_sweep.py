"""Sweeps in processes of this machine: the bytes of single runs, whatever becomes of workers and driver."""

from __future__ import annotations

import csv
import os
import shutil
import signal
import subprocess
import sys
import time
import warnings
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass, replace
from io import StringIO
from multiprocessing import Pipe
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest
from rich.console import Console
from rich.progress import Progress
from waiting import PATIENCE, wait

from esp_trainer.cli import main
from esp_trainer.cli.sweep import _Bars, _Lines, _view
from esp_trainer.run.directory import RunDirectory
from esp_trainer.sweep.local import LocalPool, _Warned
from esp_trainer.sweep.plan import read_plan
from esp_trainer.sweep.pool import Work
from esp_trainer.sweep.results import is_whole, result_of, sweep_table

if TYPE_CHECKING:
    from collections.abc import Iterator

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for processes in /proc")

CELLS = ["smoke-esp.n_trials=40", "smoke-esp.n_trials=60"]
LONG = 120  # generations: enough to be disturbed


def sweep(file: Path, out: Path, *options: str) -> int:
    return main(["sweep", str(file), "--out", str(out), *options])


def single(name: str, generations: int, out: Path) -> Path:
    """The run that ``train`` makes of the same config."""
    n_trials, seed = name.removeprefix("smoke-esp.n_trials=").split("-seed")
    fields = ["--generations", str(generations), "--checkpoint_every", "2", "--esp.n_trials", n_trials, "--seed", seed]
    assert main(["train", "smoke", *fields, "--out", str(out / name), "--quiet"]) == 0
    return out / name


@pytest.fixture(scope="module")
def long_runs(tmp_path_factory: pytest.TempPathFactory, snapshot: Any) -> dict[str, dict[str, bytes]]:
    """Of each cell, what a single run of seed 0 leaves that nothing disturbed."""
    path = tmp_path_factory.mktemp("single")
    return {cell: snapshot(single(f"{cell}-seed0", LONG, path)) for cell in CELLS}


@dataclass(frozen=True)
class Swept:
    """A sweep with two runs of each cell that nothing disturbed: its file, its directory, and what it said."""

    file: Path
    out: Path
    output: str
    error: str


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory, declare: Any) -> Swept:
    """Not to be changed."""
    place = tmp_path_factory.mktemp("whole")
    file, out = declare(place / "sweep.toml"), place / "out"
    with redirect_stdout(StringIO()) as output, redirect_stderr(StringIO()) as error:
        assert sweep(file, out, "--workers", "2") == 0
    return Swept(file, out, output.getvalue(), error.getvalue())


def workers_of(pid: int) -> list[int]:
    found = []
    for entry in Path("/proc").iterdir():
        try:
            if entry.name.isdecimal() and b"spawn_main" in (entry / "cmdline").read_bytes():
                parent = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
                found += [int(entry.name)] if parent == pid else []
        except OSError:
            continue
    return found


def test_every_run_has_the_bytes_of_a_single_one(whole: Swept, tmp_path: Path, snapshot: Any) -> None:
    output, error = whole.output, whole.error
    names = [f"{cell}-seed{seed}" for cell in CELLS for seed in (0, 1)]
    for name in names:
        expected = single(name, 6, tmp_path / "single")
        assert snapshot(whole.out / name) == snapshot(expected)
    assert [line.split()[:2] for line in output.splitlines()[1:3]] == [[cell, "2/2"] for cell in CELLS]
    assert output.splitlines()[-1] == f"  esp-trainer compare {whole.out}"
    assert error.splitlines()[0] == f"4 runs in {whole.out}"
    assert sum("6 generations, " in line for line in error.splitlines()) == 4
    assert (whole.out / "sweep.toml").read_bytes() == whole.file.read_bytes()
    with (whole.out / "runs.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["run"] for row in rows] == names
    assert all(row["generations"] == "6" and not row["failed"] for row in rows)


def test_the_same_command_does_what_is_missing_and_what_was_added(
    whole: Swept, declared: Any, tmp_path: Path, snapshot: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two runs of four generations go on to six, and two others are added."""
    out = tmp_path / "out"
    assert sweep(declared(seeds=1, generations=4), out, "--workers", "1") == 0
    capsys.readouterr()
    assert sweep(declared(seeds=1, generations=4), out, "--workers", "1") == 0
    assert f"2 runs in {out}, 2 of them complete\n" in capsys.readouterr().err
    assert sweep(declared(seeds=2, generations=6), out, "--workers", "1") == 0
    assert capsys.readouterr().err.startswith(f"4 runs in {out}\n")
    for cell in CELLS:
        for seed in (0, 1):
            name = f"{cell}-seed{seed}"  # of which the test above holds what it must be
            assert snapshot(out / name) == snapshot(whole.out / name)


def test_runs_that_fail_are_listed_with_their_reason_and_the_others_kept(
    declared: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, file = tmp_path / "out", declared(seeds=1)
    other = out / f"{CELLS[0]}-seed0"
    assert main(["train", "smoke", "--generations", "1", "--out", str(other), "--quiet"]) == 0
    taken = RunDirectory(out / "taken")
    capsys.readouterr()
    assert sweep(file, out, "--workers", "1") == 1
    output = capsys.readouterr().out
    reason = f"{other} holds another run: esp.n_trials is 100 there and 40 in the sweep"
    assert f"failed: {CELLS[0]}-seed0: {reason}\n" in output
    assert [line.split()[1] for line in output.splitlines()[1:3]] == ["0/1", "1/1"]
    assert reason in (out / "runs.csv").read_text()
    assert not taken.path.exists()


def test_a_run_that_lost_something_is_not_whole_and_says_what(
    whole: Swept, declared: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each of four runs lost another thing; two more are added, and are whole."""
    file, out = declared(seeds=3), Path(shutil.copytree(whole.out, tmp_path / "out"))
    no_log, damaged_log, less, no_config = (out / f"{cell}-seed{seed}" for cell in CELLS for seed in (0, 1))
    (no_log / "metrics.jsonl").unlink()
    (damaged_log / "metrics.jsonl").write_text("[" * 9999 + "\n")
    (less / "champions/prey-00003.safetensors").unlink()
    (no_config / "config.json").unlink()
    says = {
        no_log: "metrics.jsonl must hold 6 whole lines, got 0",
        damaged_log: "metrics.jsonl must hold 6 whole lines, got 1",
        less: "its log, its champions or its checkpoint are not",
        no_config: "is not an empty directory, and holds no run",
    }
    capsys.readouterr()
    for _ in range(2):
        assert sweep(file, out, "--workers", "1") == 1
        output, error = capsys.readouterr()
        assert "Traceback" not in error
        failed = [line for line in output.splitlines() if line.startswith("failed: ")]
        assert len(failed) == 4
        for (run, reason), line in zip(says.items(), failed, strict=True):
            assert line.startswith(f"failed: {run.name}: ")
            assert reason in line
        assert [line.split()[1] for line in output.splitlines()[1:3]] == ["1/3", "1/3"]


def test_a_sweep_is_not_done_inside_a_run(declared: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = tmp_path / "run"
    assert main(["train", "smoke", "--generations", "1", "--out", str(run), "--quiet"]) == 0
    assert sweep(declared(), run) == 1
    assert f"{run} holds a run; choose another directory for a sweep" in capsys.readouterr().err


def test_a_sweep_that_another_process_does_is_left_alone(
    declared: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    directory = RunDirectory(tmp_path)
    directory.lock()
    assert sweep(declared(), tmp_path) == 1
    assert capsys.readouterr().err == f"esp-trainer: {tmp_path} is in use by another process or trainer\n"
    assert not (tmp_path / "runs.csv").exists()


@pytest.mark.parametrize(("stopped_by", "code"), [(0, 1), (signal.SIGHUP, 128 + signal.SIGHUP)])
@pytest.mark.parametrize("buffering", [1, -1], ids=["lines", "all"])
def test_the_table_is_kept_and_a_stop_is_told_though_nobody_reads(
    buffering: int, stopped_by: int, code: int, declared: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The output goes to ``| true``, or to a terminal that has closed."""
    out = tmp_path / "out"
    monkeypatch.setattr("esp_trainer.cli.sweep._do", lambda *_, **__: ({}, stopped_by))
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "w", buffering=buffering) as stdout:
        monkeypatch.setattr(sys, "stdout", stdout)
        assert sweep(declared(), out) == code
    assert len((out / "runs.csv").read_text().splitlines()) == 1 + 4


def test_what_all_workers_warn_of_is_one_warning(declared: Any, tmp_path: Path) -> None:
    (run, *_) = read_plan(declared())
    pool = LocalPool([], 0)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("default")
        for _ in range(3):
            worker, (ours, theirs) = SimpleNamespace(work=Work(tmp_path, run.config)), Pipe()
            worker.connection = ours
            theirs.send(_Warned("no place", RuntimeWarning, "predprey_env", 0))
            theirs.send(None)
            assert pool._look(worker) is None
            assert pool._look(worker) == (tmp_path, None)
    assert [str(warning.message) for warning in caught] == ["no place"]


class InterruptedPool:
    """A pool whose user presses Ctrl-C while runs are done, and again and again while they end."""

    def __init__(self, *_: Any) -> None:
        self.outcomes = self.close = lambda *_: os.kill(os.getpid(), signal.SIGINT)

    def stop(self) -> None:
        """Ctrl-C ends the waiting for the generations in hand."""
        os.kill(os.getpid(), signal.SIGINT)
        pytest.fail("the second was not obeyed")


def test_a_second_interrupt_stops_at_once_and_is_told_how_to_go_on(
    declared: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file, out = declared(), tmp_path / "out"
    monkeypatch.setattr("esp_trainer.cli.sweep.LocalPool", InterruptedPool)
    assert sweep(file, out) == 128 + signal.SIGINT
    output, error = capsys.readouterr()
    assert error.splitlines()[1:] == [
        "stopping after the generations in hand; Ctrl-C now stops at once",
        f"stopped; go on with: esp-trainer sweep {file} --out {out}",
    ]
    assert f"  every run     {out / 'runs.csv'}\n" in output
    assert len((out / "runs.csv").read_text().splitlines()) == 1 + 4


@contextmanager
def piped(data: bytes) -> Iterator[Path]:
    """What a shell makes of ``<(...)``."""
    reader, writer = os.pipe()
    os.write(writer, data)
    os.close(writer)
    yield Path(f"/dev/fd/{reader}")
    os.close(reader)


def test_a_sweep_from_a_pipe_is_kept_beside_its_runs_and_goes_on_from_there(
    declared: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    monkeypatch.setattr("esp_trainer.cli.sweep._do", lambda *_, **__: ({}, signal.SIGTERM))
    with piped(declared().read_bytes()) as pipe:
        assert sweep(pipe, out) == 128 + signal.SIGTERM
    assert (out / "sweep.toml").read_bytes() == declared().read_bytes()
    assert f"stopped; go on with: esp-trainer sweep {out / 'sweep.toml'} --out {out}\n" in capsys.readouterr().err


def test_a_sweep_from_a_pipe_needs_a_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    with piped(b'preset = "smoke"') as pipe:
        assert main(["sweep", str(pipe)]) == 1
    says = f"{pipe} has no name of its own for the directory of the runs: give it by --out"
    assert capsys.readouterr().err == f"esp-trainer: {says}\n"
    assert not list(tmp_path.iterdir())


def test_bars_of_runs_whose_logs_cannot_be_looked_at_are_drawn(declared: Any) -> None:
    """Their workers fail, which the table says."""
    (run, *_) = plan = read_plan(declared(seeds=1))
    with Progress(console=Console(file=StringIO())) as progress:
        bars = _Bars(plan, Path("x" * 300), progress)
        bars(run.name, "File name too long")
        assert [task.completed for task in progress.tasks] == [0]


def test_on_a_dumb_terminal_there_are_lines_and_no_bars(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    for terminal, kind in (("dumb", _Lines), ("xterm", _Bars)):
        monkeypatch.setenv("TERM", terminal)
        with _view([], tmp_path, quiet=False) as look:
            assert type(look) is kind


def begin(file: Path, out: Path) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "esp_trainer", "sweep", str(file), "--out", str(out), "--workers", "2"]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)


def under_way(out: Path, driver: subprocess.Popen[str]) -> None:
    wait(lambda: driver.poll() is not None or len(list(out.glob("*/checkpoint.safetensors"))) >= 2)
    assert driver.poll() is None, "the sweep was over before it could be disturbed"


@pytest.mark.slow
def test_a_worker_that_is_killed_costs_only_time(declared: Any, tmp_path: Path, snapshot: Any, long_runs: Any) -> None:
    file, out = declared(seeds=1, generations=LONG), tmp_path / "out"
    driver = begin(file, out)
    under_way(out, driver)
    for worker in workers_of(driver.pid):
        os.kill(worker, signal.SIGKILL)
    output, _ = driver.communicate(timeout=PATIENCE)
    assert driver.returncode == 0
    assert [line.split()[1] for line in output.splitlines()[1:3]] == ["1/1", "1/1"]
    for cell, expected in long_runs.items():
        assert snapshot(out / f"{cell}-seed0") == expected


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL], ids=lambda number: number.name)
def test_a_sweep_that_is_stopped_leaves_nobody_behind_and_goes_on(
    number: signal.Signals, declared: Any, tmp_path: Path, snapshot: Any, long_runs: Any
) -> None:
    file, out = declared(seeds=1, generations=LONG), tmp_path / "out"
    driver = begin(file, out)
    under_way(out, driver)
    workers = workers_of(driver.pid)
    assert len(workers) == 2
    if number == signal.SIGINT:
        os.killpg(driver.pid, number)  # as a terminal does, to all in the foreground
    else:
        driver.send_signal(number)
    _, error = driver.communicate(timeout=PATIENCE)
    wait(lambda: not any(Path(f"/proc/{worker}/cmdline").exists() for worker in workers))
    assert "Traceback" not in error
    if number != signal.SIGKILL:
        assert driver.returncode == 128 + number
        assert f"stopped; go on with: esp-trainer sweep {file} --out {out} --workers 2\n" in error
        # With a checkpoint of the last generation, not of the last that was due.
        for cell in CELLS:
            done = len((out / f"{cell}-seed0/metrics.jsonl").read_bytes().splitlines())
            assert RunDirectory(out / f"{cell}-seed0").champion_generations("prey") == list(range(done))
    assert sweep(file, out, "--workers", "1") == 0
    for cell, expected in long_runs.items():
        assert snapshot(out / f"{cell}-seed0") == expected


@pytest.mark.slow
def test_a_run_that_kills_its_workers_is_given_up(declared: Any, tmp_path: Path) -> None:
    file, out = declared(seeds=1, generations=3000), tmp_path / "out"
    driver = begin(file, out)
    victim = out / f"{CELLS[0]}-seed0"
    killed: set[int] = set()

    def holder() -> int | None:
        """The worker that has the run's log open."""
        for worker in workers_of(driver.pid):
            try:
                files = {entry.resolve() for entry in Path(f"/proc/{worker}/fd").iterdir()}
            except OSError:
                continue
            if victim / "metrics.jsonl" in files and worker not in killed:
                return worker
        return None

    for _ in range(3):
        worker = wait(holder)
        killed.add(worker)
        os.kill(worker, signal.SIGKILL)
    wait(lambda: (out / "sweep.toml").exists())
    time.sleep(0.5)
    driver.send_signal(signal.SIGINT)
    output, _ = driver.communicate(timeout=PATIENCE)
    assert f"failed: {victim.name}: its process was lost 3 times, the last time by SIGKILL" in output


def test_a_run_is_whole_with_its_checkpoint_and_its_champions(whole: Swept, declared: Any, tmp_path: Path) -> None:
    file, out = declared(), Path(shutil.copytree(whole.out, tmp_path / "out"))
    run = read_plan(file)[0]
    assert is_whole(out / run.name, run)
    (out / run.name / "champions/prey-00003.safetensors").unlink()
    assert not is_whole(out / run.name, run)
    assert not is_whole(out / "nowhere", run)


def test_figures_are_means_over_the_last_twenty_generations(declared: Any, tmp_path: Path) -> None:
    run = read_plan(declared(seeds=1, generations=30))[0]
    path = tmp_path / run.name
    path.mkdir()
    (path / "config.json").touch()
    rates = [{"rate": rate} for rate in [9.0] * 10 + [0.25] * 10 + [0.75] * 10]
    held_out = [{"caught": rate, "predators_succeed": rate, "prey_succeed": rate} for rate in rates]
    lines = [f'{{"generation": {n}, "held_out": {each}}}\n'.replace("'", '"') for n, each in enumerate(held_out)]
    (path / "metrics.jsonl").write_text("".join(lines))
    result = result_of(path, run, None)
    assert result.figures == {"caught": 0.5, "predators_succeed": 0.5, "prey_succeed": 0.5}
    assert result.generations == 30
    assert not result.whole  # there is no checkpoint
    assert sweep_table([replace(result, whole=True)])[1].split() == [run.cell, "1/1", "0.500", "0.500", "0.500"]
