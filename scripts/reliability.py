"""Kill the trainer, fill its disk, run it for long, and write down what holds: ``docs/reliability.md``.

    python scripts/reliability.py              # every part, in about an hour
    python scripts/reliability.py crash disk   # these parts; what is kept of the others stays
    python scripts/reliability.py page         # only the page again, from what is kept

Each part keeps its figures in ``docs/reliability``. ``disk`` mounts a small one, which takes the right to do so.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from bench.report import machine
from reliability import crash, disk, full_sweep, fuzz, long, page, small_disk, victims, writes
from tqdm import tqdm

from esp_trainer.files import to_json, write


def main() -> int:
    """Do what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"{', '.join(PARTS)}, page")
    parser.add_argument("--out", type=Path, default=Path("docs/reliability"), help="where figures are kept")
    parser.add_argument("--kills", type=int, default=200, help="in all")
    parser.add_argument("--generations", type=int, default=2000, help="of the long run")
    parser.add_argument("--seed", type=int, default=0, help="of the moments of the kills")
    options = parser.parse_args()
    if unknown := set(options.parts) - {*PARTS, "page"}:
        parser.error(f"a part must be one of {', '.join(PARTS)} and page, got {', '.join(sorted(unknown))}")
    options.out.mkdir(parents=True, exist_ok=True)
    faults: list[str] = []
    for name in options.parts or PARTS:
        if name != "page":
            found, wrong = PARTS[name](options)
            write(options.out / f"{name}.json", to_json(found))
            faults += wrong
    print(page.write(options.out))
    print("\n".join(faults), file=sys.stderr, end="\n" if faults else "")
    return 1 if faults else 0


def _crash(options: argparse.Namespace) -> tuple[dict[str, Any], list[str]]:
    tallies: dict[str, crash.Tally] = {}
    for name, kind in victims.KINDS.items():
        kills = round(options.kills * kind.share)
        with TemporaryDirectory() as place, tqdm(total=kills, desc=f"killing {name}", unit="kill") as bar:
            victim = kind.victim(Path(place) / "work", kind.generations)
            tallies[name] = crash.crash(victim, kills, options.seed, bar.update)
    faults = [f"{name}: {fault}" for name, tally in tallies.items() for fault in tally.faults]
    return {"machine": machine(PACKAGES), "commands": {name: each.as_dict() for name, each in tallies.items()}}, faults


def _disk(_options: argparse.Namespace) -> tuple[dict[str, Any], list[str]]:
    if reason := small_disk.refused():
        sys.exit(f"reliability.py: no disk can be mounted here: {reason}")
    found: dict[str, dict[str, Any]] = {}
    faults: list[str] = []
    with TemporaryDirectory() as place:
        before = writes.materials(Path(place))
        for shortage in disk.SHORTAGES.values():
            for name, each in writes.WRITES.items():
                with tqdm(desc=f"{shortage.name}: {name}", unit="disk") as bar:
                    tally = disk.fill(each, before[each.after], shortage, bar.update)
                found.setdefault(shortage.name, {})[name] = tally.as_dict()
                faults += [f"{name}, {fault}" for fault in tally.faults]
    with tqdm(desc="pages: sweep", unit="disk") as bar:
        tally = full_sweep.fill(bar.update)
    found["pages"]["sweep"] = tally.as_dict()
    faults += [f"sweep, {fault}" for fault in tally.faults]
    return {"machine": machine(PACKAGES), "shortages": found}, faults


def _long(options: argparse.Namespace) -> tuple[dict[str, Any], list[str]]:
    with TemporaryDirectory() as place, tqdm(total=options.generations, desc="a long run", unit="gen") as bar:
        watched = long.run(Path(place), options.generations, lambda done: bar.update(done - bar.n))
    long.draw(watched, options.out / "long-run.png")
    return long.figures(watched) | {"early": long.EARLY, "span": long.SPAN, "machine": machine(PACKAGES)}, []


def _fuzz(_options: argparse.Namespace) -> tuple[dict[str, Any], list[str]]:
    return fuzz.fuzz(), []


PACKAGES = ("numpy", "numba", "safetensors")
Measure = Callable[[argparse.Namespace], tuple[dict[str, Any], list[str]]]
PARTS: dict[str, Measure] = {"crash": _crash, "disk": _disk, "long": _long, "fuzz": _fuzz}
"""Name -> what is found, as JSON has it, and what ought not to be."""

if __name__ == "__main__":
    sys.exit(main())
