"""The reliability measurements in small: a few kills, a few disks, a short run, and the page of them."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

SCRIPTS = Path(__file__).parents[1] / "scripts"
sys.path.insert(0, str(SCRIPTS))

from reliability import crash, disk, full_sweep, long, page, processes, runs, small_disk, victims, writes  # noqa: E402

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="takes Linux")

KILLS = {"train": (60, 3), "sweep": (30, 4), "report": (12, 2)}
"""Generations, and kills."""


@pytest.mark.slow
@pytest.mark.parametrize("name", KILLS)
def test_what_is_killed_is_done_in_the_end_as_if_it_had_not_been(name: str, tmp_path: Path) -> None:
    generations, kills = KILLS[name]
    tally = crash.crash(victims.KINDS[name].victim(tmp_path / "work", generations), kills, seed=1)
    assert tally.faults == []
    assert tally.kills >= kills
    assert tally.kills == sum(tally.found.values()) + tally.workers
    assert tally.again <= victims.EVERY
    assert tally.ends >= 1
    assert tally.compared >= tally.ends * (2 * generations if name != "train" else generations)


def test_every_command_that_is_killed_has_its_share() -> None:
    assert set(KILLS) == set(victims.KINDS)
    assert sum(kind.share for kind in victims.KINDS.values()) == pytest.approx(1)


class Faulty:
    """A run that comes to another end after a kill."""

    start_up, at_work = 0.05, 0.05

    def __init__(self, place: Path) -> None:
        self.place, self.whole, self.lives = place, {"file": b"whole"}, 0
        place.mkdir()

    def renew(self) -> None:
        self.lives = 0
        (self.place / "file").write_bytes(b"whole")

    def command(self) -> list[object]:
        self.lives += 1
        if self.lives > 1:
            (self.place / "file").write_bytes(b"other")
            (self.place / ".file.part").touch()
        return ["presets"]

    def state(self) -> str:
        return "something"

    def check(self) -> int:
        raise AssertionError("it is lost")


def test_a_run_that_is_not_the_same_after_a_kill_is_seen(tmp_path: Path) -> None:
    tally = crash.crash(Faulty(tmp_path / "work"), kills=1, seed=0)
    assert tally.kills == 1
    assert tally.lost == ["it is lost"]
    assert tally.differing == [".file.part", "file"]
    assert tally.left == [".file.part"]


@pytest.fixture(scope="module")
def may_mount() -> None:
    """Skips where one may not mount, as in most containers."""
    reason = small_disk.refused()
    if reason:
        pytest.skip(f"no disk can be mounted here: {reason}")


@pytest.fixture(scope="module")
def materials(may_mount: None, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    return writes.materials(tmp_path_factory.mktemp("materials") / "made")


STEPS = {"train": 9, "resume": 7, "report": 15, "analyse --figures": 7, "behaviours --csv": 1, "replay --gif": 9}
"""Every how many sizes of a full disk is tried."""


@pytest.mark.slow
@pytest.mark.parametrize("name", STEPS)
def test_a_full_disk_is_told_and_spoils_nothing(name: str, materials: dict[str, Path]) -> None:
    write = writes.WRITES[name]
    tally = disk.fill(write, materials[write.after], disk.SHORTAGES["pages"], step=STEPS[name])
    assert tally.faults == []
    assert tally.tried >= 2
    assert sum(tally.hit.values()) == tally.tried


@pytest.mark.slow
def test_a_sweep_on_a_full_disk_lists_what_failed_and_goes_on(may_mount: None) -> None:
    tally = full_sweep.fill(step=25)
    assert tally.faults == []
    assert tally.tried >= 3
    assert sum(tally.hit.values()) >= tally.tried


@pytest.mark.slow
@pytest.mark.parametrize("shortage", ["names", "read-only"])
def test_a_disk_that_takes_no_file_is_told_and_spoils_nothing(shortage: str, materials: dict[str, Path]) -> None:
    write = writes.WRITES["resume"]
    tally = disk.fill(write, materials[write.after], disk.SHORTAGES[shortage], step=4)
    assert tally.faults == []
    assert tally.tried >= 1


def test_a_disk_is_filled_to_the_page_and_to_the_name(may_mount: None) -> None:
    with small_disk.small_disk(pages=40, names=20) as small:
        small.leave_pages(3)
        assert os.statvfs(small.place).f_bavail == 3
        small.make_room()
        small.leave_names(2)
        assert os.statvfs(small.place).f_ffree == 2
        small.make_room()
        assert list(small.place.iterdir()) == []
        small.seal()
        with pytest.raises(OSError, match="Read-only"):
            (small.place / "file").touch()
        small.make_room()
        (small.place / "file").touch()


def test_what_is_half_written_is_seen(tmp_path: Path) -> None:
    """Files that are neither old nor new, that are gone, or in the making."""
    whole = {"page.html": b"new", "table.csv": b"new", "figure.png": b"new"}
    before = dict.fromkeys(whole, b"old")
    for name, data in {"page.html": b"ne", "table.csv": b"new", ".x.part": b""}.items():
        (tmp_path / name).write_bytes(data)
    found = list(disk._spoilt(tmp_path, before, whole))
    assert found == [".x.part is left", "page.html is half written", "figure.png is gone", ".x.part is half written"]


@pytest.mark.parametrize(
    ("said", "excuse"),
    [
        ("getting ready\nesp-trainer: a/b: No space left on device\n", ""),
        ("esp-trainer: one\nesp-trainer: two\n", "said"),
        ("esp-trainer: one\nTraceback (most recent call last):\n", "said"),
        ("esp-trainer: one\nException ignored in ...\n", "said"),
        ("nothing of ours\n", "said"),
    ],
)
def test_only_one_last_line_of_ours_will_do(said: str, excuse: str) -> None:
    assert processes.Ended(1, said).excuse.startswith(excuse)
    assert bool(processes.Ended(1, said).excuse) == bool(excuse)
    assert processes.Ended(0, said).excuse == "ended with 0"
    assert processes.Ended(-9, said).excuse == "ended with -9"


@pytest.mark.slow
def test_a_run_is_watched_from_outside(tmp_path: Path) -> None:
    watched = long.run(tmp_path, 500, options=(*runs.TINY, "--esp.hof_mates", 1, "--env.size", 12))
    assert len(watched["seconds"]) == 500
    assert (watched["seconds"] > 0).all()
    assert (np.diff(watched["seen"]) >= 0).all()
    assert (watched["megabytes"] > 50).all()
    figures = long.figures(watched)
    assert figures["megabytes late"] == pytest.approx(watched["megabytes"][-1], abs=0.1)
    assert figures["milliseconds late"] == pytest.approx(1000 * np.median(watched["seconds"][300:]), abs=0.01)
    assert 0 < figures["cpu late"] < 1000
    long.draw(watched, tmp_path / "long.png")
    header, *rows = (tmp_path / "long.csv").read_text().splitlines()
    assert header == "generation,megabytes,wall ms,CPU ms"
    assert len(rows) == 500
    assert "nan" not in "".join(rows)


def test_memory_of_this_process_is_read_and_of_none_is_none() -> None:
    assert long.resident(os.getpid()) > 50
    assert long.spent(os.getpid()) > 0.1
    ended = subprocess.Popen(["true"])
    ended.wait()
    assert long.resident(ended.pid) == long.spent(ended.pid) == 0


MACHINE = {"machine": "a machine"}
KEPT: dict[str, dict[str, Any]] = {
    "crash": MACHINE | {"commands": {"train": crash.Tally(9, 0, Counter(train=2, resume=7), Counter(x=9)).as_dict()}},
    "disk": MACHINE | {"shortages": {"pages": {"train": disk.Tally(7, Counter({"run/config.json": 7})).as_dict()}}},
    "long": MACHINE
    | {f"{what} {when}": 1.0 for what in ("megabytes", "milliseconds", "cpu") for when in ("early", "late", "at most")}
    | {"generations": 2000, "seconds": 90, "early": 100, "span": 200},
    "fuzz": {"files": {"read_log": 2000}, "refused": {"read_log": 1000}, "seconds": 9.5},
}


@pytest.mark.parametrize("parts", [[], ["crash"], ["long", "fuzz"], [*KEPT]], ids=str)
def test_the_page_is_about_what_was_measured(parts: list[str], tmp_path: Path) -> None:
    kept = tmp_path / "reliability"
    kept.mkdir()
    for part in parts:
        (kept / f"{part}.json").write_text(json.dumps(KEPT[part]))
    text = page.write(kept).read_text()
    titles = {"crash": "Killed", "disk": "A full disk", "long": "A long run", "fuzz": "Damaged files"}
    assert re.findall(r"^## (.*)$", text, re.MULTILINE) == [title for part, title in titles.items() if part in parts]
    for table in re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE):
        assert len({line.count("|") for line in table.splitlines()}) == 1
    (kept / "mutation.md").write_text("# Mutation")
    assert "(reliability/mutation.md)" in page.write(kept).read_text()


def test_a_part_that_does_not_exist_is_refused() -> None:
    command = [sys.executable, str(SCRIPTS / "reliability.py"), "nothing"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "a part must be one of crash, disk, long, fuzz and page, got nothing" in done.stderr
