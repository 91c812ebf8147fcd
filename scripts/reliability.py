"""Kill the trainer at random moments, fill its disk, and run it for long; print what happened as a table.

    python scripts/reliability.py kill              # 200 kills; --kills for another number
    python scripts/reliability.py disk              # a disk that is full after any page; needs the right to mount
    python scripts/reliability.py long              # 2,000 generations; --generations for another number

Every killed or failed command is given again until its work is done. The exit code is 1 if a file then differs from
what an undisturbed command leaves. ``docs/reliability.md`` keeps the figures that were measured, and names the tests.
"""

from __future__ import annotations

import argparse
import mmap
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.presets import preset
from esp_trainer.run.directory import RunDirectory
from esp_trainer.run.trainer import Trainer

TRAINER = [sys.executable, "-m", "esp_trainer"]
SWEEP = """preset = "smoke"
seeds = 2
[fields]
generations = {generations}
checkpoint_every = 5
esp.subpopulation_size = 8
esp.n_trials = [8, 16]
champion.n_candidates = 2
champion.n_held_out = 8
"""
TINY = "--esp.subpopulation_size 8 --esp.n_trials 16 --champion.n_candidates 2 --champion.n_held_out 8 --quiet"
CHAMPIONS = "run/champions/predators-00005.safetensors --against run/champions/prey-00005.safetensors"
PLAYED, OLDER = "--generations 4 --episodes 8", "--generations 3 --episodes 4"


class WritingCommand(NamedTuple):
    """A command that writes."""

    arguments: str
    older: str | None = None
    """The command that leaves an older version of its files in the run that it reads; None if it begins in an empty
    directory."""

    def again(self, place: Path) -> list[str]:
        """Return the command that does, or completes, the work in a directory."""
        begun = self.arguments.startswith("train") and (place / "run/config.json").exists()
        return ("resume run --quiet" if begun else self.arguments).split()


def train(generations: int) -> str:
    """Return the command of a small run."""
    return f"train smoke {TINY} --checkpoint_every 5 --out run --generations {generations}"


KILLED = {
    "train": WritingCommand(train(400)),
    "sweep": WritingCommand("sweep sweep.toml --out out --workers 2 --quiet"),
    "report": WritingCommand("report run", f"report run {OLDER}"),
}
FILLED = {
    "train": WritingCommand(train(6)),
    "train --tensorboard": WritingCommand(f"{train(6)} --tensorboard"),
    "resume --generations": WritingCommand("resume run --quiet --generations 9", ""),
    "sweep": WritingCommand("sweep sweep.toml --out out --workers 2"),
    "report": WritingCommand(f"report run {PLAYED}", f"report run {OLDER}"),
    "analyse": WritingCommand(f"analyse run {PLAYED} --figures figures", f"analyse run {OLDER} --figures figures"),
    "behaviours": WritingCommand(f"behaviours run {PLAYED} --csv rates.csv", f"behaviours run {OLDER} --csv rates.csv"),
    "replay": WritingCommand(
        f"replay {CHAMPIONS} --until 12 --gif clip.gif", f"replay {CHAMPIONS} --until 9 --gif clip.gif"
    ),
}
PAGES, DENSE, GROWTH = 16_000, 40, 1.25  # of a roomy disk; up to here every number is tried, then steps grow


def prepare(command: WritingCommand, place: Path, generations: int = 6) -> None:
    """Put into a directory what the command finds there."""
    place.mkdir(parents=True, exist_ok=True)
    (place / "sweep.toml").write_text(SWEEP.format(generations=generations))
    for earlier in [] if command.older is None else [train(6), command.older]:
        if earlier and (ended := run(earlier.split(), place)).returncode:
            raise RuntimeError(f"{earlier}: {ended.stderr}")


def begin(arguments: list[str], place: Path) -> subprocess.Popen[str]:
    """Start the trainer as the head of a process group, so that its workers can be killed with it."""
    pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
    return subprocess.Popen([*TRAINER, *arguments], cwd=place, text=True, start_new_session=True, **pipes)


def run(arguments: list[str], place: Path) -> subprocess.CompletedProcess[str]:
    """Let the trainer do a command to its end."""
    process = begin(arguments, place)
    _, said = process.communicate()
    return subprocess.CompletedProcess(arguments, process.returncode, "", said)


def snapshot(place: Path) -> dict[str, bytes]:
    """Return the bytes of every file but those that hold wall seconds."""
    files = [file for file in place.rglob("*") if file.is_file()]
    timed = [file for file in files if file.name == "timing.jsonl" or "tfevents" in file.name]
    return {str(file.relative_to(place)): file.read_bytes() for file in files if file not in timed}


def different(found: dict[str, bytes], expected: dict[str, bytes]) -> list[str]:
    """Return the names of files that are in only one of both, or that differ."""
    return sorted(name for name in {**found, **expected} if found.get(name) != expected.get(name))


def half_written(place: Path) -> list[str]:
    """Return the temporary files of writes that were cut off."""
    return sorted(str(path.relative_to(place)) for path in place.rglob(".*.part"))


def kill(
    command: WritingCommand, kills: int, place: Path, generations: int = 200, seed: int = 0
) -> tuple[int, int, list[str]]:
    """Kill a command at random moments, give it again until its work is done, and compare; repeat.

    Returns:
        How many kills left a half-written file, how often the work was done, and the faults.
    """
    chance, hit, cut, done, faults = random.Random(seed), 0, 0, 0, list[str]()
    before, whole, work = place / "before", place / "whole", place / "work"
    prepare(command, before, generations)
    shutil.copytree(before, whole)
    begun = time.monotonic()
    run(command.again(whole), whole)
    seconds, expected = time.monotonic() - begun, snapshot(whole)
    while hit < kills:
        shutil.rmtree(work, ignore_errors=True)
        shutil.copytree(before, work)
        code = -signal.SIGKILL
        while code == -signal.SIGKILL:
            process = begin(command.again(work), work)
            with suppress(subprocess.TimeoutExpired):  # one life in five is spared, so that long work gets done
                process.wait(None if hit >= kills or chance.random() < 0.2 else chance.uniform(0, seconds))
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
            _, said = process.communicate()
            code = process.returncode
            hit += code == -signal.SIGKILL
            cut += code == -signal.SIGKILL and bool(half_written(work))
        done += 1
        faults += [said] if code else [f"{name} differs" for name in different(snapshot(work), expected)]
    return cut, done, faults


@contextmanager
def small_disk() -> Iterator[Path]:
    """Mount a tmpfs of :data:`PAGES` pages."""
    with TemporaryDirectory() as place:
        size = f"size={PAGES * mmap.PAGESIZE}"
        subprocess.run(["mount", "-t", "tmpfs", "-o", size, "tmpfs", place], check=True, capture_output=True)
        try:
            yield Path(place)
        finally:
            subprocess.run(["umount", "--lazy", place], check=True)


def fill(command: WritingCommand, place: Path, step: int = 1) -> tuple[int, list[str]]:
    """Give a command with 0, 1, 2 ... pages left on its disk until it succeeds; then, each time, with room again.

    Returns:
        On how many disks it failed, and the faults: other words than one line with the file and the reason, files that
        are neither old nor new, and bytes that differ once there was room.
    """
    before, whole, left, failed, faults = place / "before", place / "whole", 0, 0, list[str]()
    prepare(command, before)
    shutil.copytree(before, whole)
    run(command.again(whole), whole)
    old, new = snapshot(before), snapshot(whole)
    code = 1
    while code:
        with small_disk() as disk:
            shutil.copytree(before, disk, dirs_exist_ok=True)
            filler = disk / "filler"
            filler.write_bytes(bytes((os.statvfs(disk).f_bavail - left) * mmap.PAGESIZE))
            ended = run(command.again(disk), disk)
            code = ended.returncode
            filler.unlink()
            found = []
            if code:
                failed += 1
                found += [f"{name} is left" for name in half_written(disk)]
                if not re.search(r"\S+: No space left on device\s*$", ended.stderr) or "Traceback" in ended.stderr:
                    found.append(f"said {ended.stderr!r}")
                grows = ("run/", "out/") if re.match("train|resume|sweep", command.arguments) else ()
                states = {name: data for name, data in snapshot(disk).items() if not name.startswith(grows)}
                found += [f"{name} is half done" for name in states if states[name] not in (old.get(name), new[name])]
                found += [again.stderr] if (again := run(command.again(disk), disk)).returncode else []
            found += [f"{name} differs" for name in different(snapshot(disk), new)]
            faults += [f"{left} pages: {fault}" for fault in found]
        left = left + step if left < DENSE else int(left * GROWTH) + step
    return failed, faults


def watch(generations: int, place: Path) -> Iterator[tuple[int, float, float]]:
    """Yield the number of each generation of ``paper-3v2``, the resident memory in MB, and the CPU time in ms."""
    config = preset("paper-3v2").replace(generations=generations)
    trainer = Trainer.start(RunDirectory(place / "run"), config, lambda config: FusedEvaluator(config.env, threads=1))
    spent = time.process_time()
    for number, _ in enumerate(trainer.generations()):
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        yield number, pages * mmap.PAGESIZE / 1e6, 1000 * (time.process_time() - spent)
        spent = time.process_time()


def main() -> int:
    """Do the part that the command line names, and print its table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", choices=["kill", "disk", "long"])
    parser.add_argument("--only", nargs="+", metavar="COMMAND", help="only these commands")
    parser.add_argument("--kills", type=int, default=200, help="in all (default: 200)")
    parser.add_argument("--step", type=int, default=1, help="try only every so many sizes of a full disk")
    parser.add_argument("--generations", type=int, default=2000, help="of the long run (default: 2,000)")
    options = parser.parse_args()
    faults: list[str] = []
    with TemporaryDirectory() as name:
        place = Path(name)
        if options.part == "long":
            print("| generation | MB resident | CPU ms |\n| ---: | ---: | ---: |")
            for number, megabytes, cpu in watch(options.generations, place):
                print(f"| {number} | {megabytes:.0f} | {cpu:.1f} |")
            return 0
        commands = KILLED if options.part == "kill" else FILLED
        columns = ["kills", "half-written files", "done in the end"] if options.part == "kill" else ["failures"]
        print(f"| command | {' | '.join(columns)} | faults |\n| --- |{' ---: |' * len(columns)} ---: |", flush=True)
        for name in options.only or commands:
            if options.part == "kill":
                kills = options.kills // len(options.only or commands)
                *counts, found = kills, *kill(commands[name], kills, place / name)
            else:
                *counts, found = fill(commands[name], place / name, options.step)
            print(f"| `{name}` | {' | '.join(map(str, counts))} | {len(found)} |", flush=True)
            faults += [f"{name}: {fault}" for fault in found]
    print("\n".join(faults), file=sys.stderr, end="\n" if faults else "")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
