"""``docs/reliability.md``, from the measurements that are kept beside it."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

Part = Mapping[str, Any]

_WORDS = {"pages": "full at any page", "names": "out of names for files", "read-only": "read-only"}


def write(place: Path) -> Path:
    """Put the page beside the directory of what was measured; parts that were not are left out."""
    path = place.with_suffix(".md")
    parts = [_HEAD]
    for name, section in _SECTIONS.items():
        if (place / f"{name}.json").exists():
            parts.append(section(json.loads((place / f"{name}.json").read_text()), place))
    if (place / "mutation.md").exists():
        parts.append(f"## Mutation\n\nWhich deliberate faults the tests see: [mutation]({place.name}/mutation.md).")
    path.write_text("\n\n".join(parts) + "\n")
    return path


_HEAD = """# Reliability

What becomes of a run when its process is killed, its disk is full, its files are damaged, or it goes on for long: tried
on real processes by `python scripts/reliability.py`, each part by itself. The tests do all of it in small."""


def _crash(part: Part, _place: Path) -> str:
    tallies: dict[str, Part] = part["commands"]
    columns = {
        "kills": "kills",
        "workers": "of workers",
        "cut_off": "left a half-written file",
        "ends": "done in the end",
        "compared": "files compared",
        "differing": "that differ",
        "lost": "lost",
        "left": "half-written in the end",
    }
    rows = [
        [
            ", ".join(f"`{command}`" for command in each["commands"]) or f"`{name}`",
            *(_number(each[column]) for column in columns),
        ]
        for name, each in tallies.items()
    ]
    resumed = sum(each["commands"].get("resume", 0) for each in tallies.values())
    found = [[f"`{name}`", what, n] for name, each in tallies.items() for what, n in each["found"].items()]
    kills = sum(each["kills"] for each in tallies.values())
    again, orphaned = (max(each[what] for each in tallies.values()) for what in ("again", "orphaned"))
    return f"""## Killed

{kills} processes, each killed (`SIGKILL`) at a random moment: half of them while they get ready, the others at
work, some of those at the very next write. What follows is what one would type, `resume` or the same command
again; `resume` was killed {resumed} times itself. When the work is done, its files are compared with those of a
process that nobody killed: all but `timing.jsonl`, which holds wall seconds.

{_table(["command", *columns.values()], rows)}

A kill cost a run at most the {again} generations since its last checkpoint. What it left is a part of the
uninterrupted run, and a page is a page at any moment: the old one until the new one is whole. The workers of a
sweep that was killed were gone {orphaned:.1f} seconds later at most. What was on disk at the time:

{_table(["command", "on disk", "kills"], found)}

{part["machine"]}."""


def _disk(part: Part, _place: Path) -> str:
    rows, n_faults, n_tried = [], 0, 0
    for shortage, tallies in part["shortages"].items():
        for name, each in tallies.items():
            hit = ", ".join(f"`{file}` {n}" for file, n in each["hit"].items())
            rows.append([_WORDS[shortage], f"`{name}`", each["tried"], hit, len(each["faults"])])
            n_faults, n_tried = n_faults + len(each["faults"]), n_tried + each["tried"]
    return f"""## A full disk

Every command that writes, on a disk (a tmpfs of 4 kB pages) with 0, 1, 2 and so on pages left, until it
succeeds; on one that takes no more files; and on one that is read-only. A failure must be one line that names
the file and the reason, and an exit code; every file must be as it was, or whole and new; and once there is
room, the command must end in the bytes that it would have written at once. Of {n_tried:,} failures, {n_faults}
did otherwise. (A sweep's runs fail one by one, and are listed with the file and the reason.)

{_table(["the disk is", "command", "failures", "at which file", "faults"], rows)}

{part["machine"]}."""


def _long(part: Part, place: Path) -> str:
    rows = [
        ["resident memory", *(f"{part[f'megabytes {when}']:.0f} MB" for when in ("early", "late"))],
        ["CPU time of a generation, mean", *(f"{part[f'cpu {when}']:.1f} ms" for when in ("early", "late"))],
        [
            "wall time of a generation, median",
            *(f"{part[f'milliseconds {when}']:.1f} ms" for when in ("early", "late")),
        ],
    ]
    return f"""## A long run

{part["generations"]:,} generations of `paper-3v2` at full size on one thread, in {part["seconds"] / 60:.1f} minutes.

{_table(["", "early", "late"], rows)}

Memory after {part["early"]} generations and at the end, {part["megabytes at most"]:.0f} MB at most; time that of
the {part["span"]} generations from then on, and of the last {part["span"]}. Wall time shows other work of the machine,
and peaks at 1,000 and 2,000 generations when the hall of fame is full: every second champion goes, with its file.

![Memory and time by generation]({place.name}/long-run.png)

{part["machine"]}."""


def _fuzz(part: Part, _place: Path) -> str:
    rows = [
        [
            name.removeprefix("read_").replace("source", "any file of a run, for its page"),
            _number(n),
            _number(part["refused"][name]),
        ]
        for name, n in part["files"].items()
    ]
    return f"""## Damaged files

{sum(part["files"].values()):,} files that are cut off, altered or something else, in {part["seconds"]:.0f} s
([`test_fuzz.py`](../tests/esp_trainer/test_fuzz.py)): each is refused in one line, or read as what it was. A
config or a log with another digit is another one, and is compared with the checkpoint when the run goes on.

{_table(["reader", "files", "refused"], rows)}"""


_SECTIONS = {"crash": _crash, "disk": _disk, "long": _long, "fuzz": _fuzz}


def _number(value: Any) -> str:
    return f"{len(value) if isinstance(value, list) else value:,}"


def _table(head: list[str], rows: Iterable[Iterable[object]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(map(str, line))} |" for line in lines)
