"""What is killed again and again: the commands that work for long, each in a directory of its own."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple, Protocol

from reliability.processes import begun, succeeded
from reliability.runs import (
    NOTHING,
    WHOLE,
    Snapshot,
    below,
    check_run,
    checkpointed,
    logged,
    resume,
    snapshot,
    state,
    tiny,
)

EVERY = 5
"""Generations between checkpoints."""
_FAME = ("--esp.hof_size", 100)  # so few that champions are dropped on the way


class Victim(Protocol):
    """What is killed again and again."""

    place: Path
    start_up: float
    """Seconds until the first of its work is on disk."""
    at_work: float
    """Seconds from then on to the end."""
    whole: Snapshot
    """What is there when nobody interrupts."""

    def renew(self) -> None:
        """Go back to where nothing has begun."""

    def command(self) -> list[object]:
        """What begins, or goes on with what is there."""

    def state(self) -> str:
        """What is there, in words."""

    def check(self) -> int:
        """See that nothing is lost or half done, or raise :class:`AssertionError`.

        Returns:
            The most generations that a run must do again.
        """


class Train:
    """A run, begun and resumed."""

    def __init__(self, place: Path, generations: int) -> None:
        self.place, self._generations, self._known = place, generations, 0
        whole = place.with_name("trained")
        whole.mkdir()
        command = tiny("run", generations, EVERY, *_FAME)
        self.start_up, self.at_work = timed(command, whole, lambda: logged(whole / "run") > 0)
        self.whole = snapshot(whole)

    def renew(self) -> None:
        """Begin anew."""
        shutil.rmtree(self.place, ignore_errors=True)
        self.place.mkdir()
        self._known = 0

    def command(self) -> list[object]:
        """``resume`` where there is a run."""
        return resume("run") if self._begun() else tiny("run", self._generations, EVERY, *_FAME)

    def state(self) -> str:
        """How far the run is."""
        return state(self.place / "run")

    def check(self) -> int:
        """What is there is a part of the whole run."""
        if not self._begun():
            return 0
        again = check_run(self.place / "run", below(self.whole, "run"), self._known)
        self._known = checkpointed(self.place / "run")
        return again

    def _begun(self) -> bool:
        return (self.place / "run/config.json").exists()


class Report:
    """The page of a run, in the place of an older one."""

    def __init__(self, place: Path, generations: int) -> None:
        self.place = place
        self._run = place.with_name("to report")
        self._run.mkdir()
        succeeded(tiny("run", generations, EVERY), self._run)
        succeeded([*self.command(), "--episodes", 8], self._run)
        shutil.rmtree(self._run / "run/analysis")
        whole = place.with_name("reported")
        shutil.copytree(self._run, whole)
        analysis = whole / "run/analysis/cross-play.safetensors"
        self.start_up, self.at_work = timed(self.command(), whole, analysis.exists)
        self.old, self.whole = snapshot(self._run), snapshot(whole)

    def renew(self) -> None:
        """Go back to the old page."""
        shutil.rmtree(self.place, ignore_errors=True)
        shutil.copytree(self._run, self.place)

    def command(self) -> list[object]:
        """The same each time."""
        return ["report", "run"]

    def state(self) -> str:
        """Which page is there, and whether the matches for the new one are."""
        page = (self.place / "run/report.html").read_bytes()
        if page == self.whole["run/report.html"]:
            return "the new page"
        played = (self.place / "run/analysis/cross-play.safetensors").exists()
        return "the old page, and what was played for the new one" if played else "the old page"

    def check(self) -> int:
        """The page is the old one or the new one, and the run as it was."""
        found = snapshot(self.place)
        for name, data in found.items():
            if not Path(name).name.startswith("."):
                assert data in (self.old.get(name), self.whole.get(name)), (
                    f"{name} is neither the old one nor the new one"
                )
        assert not self.old.keys() - found.keys(), "a file of the run is gone"
        return 0


class Sweep:
    """Four runs at once, by two workers."""

    def __init__(self, place: Path, generations: int) -> None:
        self.place = place
        self._declared = _DECLARED.format(generations=generations, every=EVERY)
        self._known: dict[str, int] = {}
        whole = place.with_name("swept")
        self._declare(whole)
        self.start_up, self.at_work = timed(self.command(), whole, lambda: any(map(logged, self._runs(whole))))
        self.whole = snapshot(whole)

    def _declare(self, place: Path) -> None:
        place.mkdir()
        (place / "sweep.toml").write_text(self._declared)

    def renew(self) -> None:
        """Begin anew."""
        shutil.rmtree(self.place, ignore_errors=True)
        self._declare(self.place)
        self._known = {}

    def command(self) -> list[object]:
        """The same each time."""
        return ["sweep", "sweep.toml", "--out", "out", "--workers", 2, "--quiet"]

    def state(self) -> str:
        """How many runs are begun, and whole."""
        states = [state(run) for run in self._runs(self.place)]
        whole, begun_too = states.count(WHOLE), sum(each != NOTHING for each in states)
        return f"{whole} runs whole, {begun_too - whole} begun"

    def check(self) -> int:
        """Each run that is there is a part of the whole one."""
        again = 0
        for run in self._runs(self.place):
            if (run / "config.json").exists():
                whole = below(self.whole, f"out/{run.name}")
                again = max(again, check_run(run, whole, self._known.get(run.name, 0)))
                self._known[run.name] = checkpointed(run)
        return again

    def _runs(self, place: Path) -> list[Path]:
        return sorted(path for path in (place / "out").glob("*") if path.is_dir())


_DECLARED = """preset = "smoke"
seeds = 2

[fields]
generations = {generations}
checkpoint_every = {every}
predators.n_hidden = 2
prey.n_hidden = 2
esp.subpopulation_size = 8
esp.n_trials = [8, 16]
esp.n_episodes = 1
champion.n_candidates = 2
champion.n_held_out = 8
"""


class Kind(NamedTuple):
    """A command that is killed."""

    victim: Callable[[Path, int], Victim]
    """Given a directory to work in, and how many generations its runs have."""
    generations: int
    share: float
    """Of the kills."""


KINDS = {"train": Kind(Train, 400, 0.4), "sweep": Kind(Sweep, 200, 0.3), "report": Kind(Report, 20, 0.3)}


def timed(command: list[object], where: Path, begins: Callable[[], bool]) -> tuple[float, float]:
    """Seconds of a command until something happens, and from then on to its end."""
    started = time.perf_counter()
    with begun(command, where) as process:
        while not begins() and not process.wait(0.005):
            pass
        at_work = time.perf_counter()
        ended = process.ended()
    if ended.code:
        raise RuntimeError(f"{command} ended with {ended.code}: {ended.said}")
    return at_work - started, time.perf_counter() - at_work
