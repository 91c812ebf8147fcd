"""Small runs with everything that a run writes, and what is on disk of them."""

from __future__ import annotations

import json
import re
from itertools import product
from pathlib import Path

from esp_trainer.coevolution.hall_of_fame import kept_generations
from esp_trainer.esp.team import Team
from esp_trainer.files import read_arrays
from esp_trainer.run.directory import RunDirectory, whole_lines
from esp_trainer.types import ROLES

TINY = (
    *("--predators.n_hidden", 2, "--prey.n_hidden", 2, "--esp.subpopulation_size", 8, "--esp.n_trials", 16),
    *("--esp.n_episodes", 1, "--champion.n_candidates", 2, "--champion.n_held_out", 8),
)
"""What makes a generation of the preset ``smoke`` last milliseconds."""

Snapshot = dict[str, bytes]
NOTHING, WHOLE = "nothing", "all its generations"


def tiny(out: str, generations: int, checkpoint_every: int, *options: object) -> list[object]:
    """The command that begins a small run."""
    size = ["--generations", generations, "--checkpoint_every", checkpoint_every]
    return ["train", "smoke", *TINY, *size, *options, "--out", out, "--quiet", "--threads", 2]


def resume(out: str, *options: object) -> list[object]:
    """The command that goes on with it."""
    return ["resume", out, *options, "--quiet", "--threads", 2]


def snapshot(place: Path) -> Snapshot:
    """The bytes of every file under a directory but those that hold wall seconds: ``timing.jsonl``, and what
    TensorBoard reads.
    """
    files = (file for file in sorted(place.rglob("*")) if file.is_file())
    return {
        str(file.relative_to(place)): file.read_bytes()
        for file in files
        if file.name != "timing.jsonl" and "tfevents" not in file.name
    }


def different(found: Snapshot, expected: Snapshot) -> list[str]:
    """The names of files that only one of both has, or that differ."""
    return sorted(name for name in {**found, **expected} if found.get(name) != expected.get(name))


def half_written(place: Path) -> list[str]:
    """What is left of writes that were cut off."""
    return sorted(str(path.relative_to(place)) for path in place.rglob(".*"))


def logged(run: Path) -> int:
    """Generations in a run's log."""
    return len(whole_lines(run / "metrics.jsonl"))


def checkpointed(run: Path) -> int:
    """Generations behind a run's checkpoint; :class:`~esp_trainer.files.DamagedFileError` if it is not whole."""
    file = run / "checkpoint.safetensors"
    return int(read_arrays(file, "checkpoint")[0]["generations"]) if file.exists() else 0


def below(whole: Snapshot, folder: str) -> Snapshot:
    """Of a snapshot the part in a folder, by the names there."""
    return {name.removeprefix(f"{folder}/"): data for name, data in whole.items() if name.startswith(f"{folder}/")}


def grows(name: str) -> bool:
    """Whether a file in the directory ``run`` grows with the run."""
    return re.fullmatch(r"run/(config\.json|metrics\.jsonl|checkpoint\.safetensors|champions/.*)", name) is not None


def check_run(run: Path, whole: Snapshot, known: int = 0) -> int:
    """See that what is there of a run is a part of the whole one, and can go on.

    Args:
        run: Its directory.
        whole: What is in it when nobody interrupts.
        known: Generations behind its checkpoint some time before.

    Returns:
        Generations that were logged after the checkpoint, and must be done again.
    """
    done, lines = checkpointed(run), whole_lines(run / "metrics.jsonl")
    assert done >= known, f"the checkpoint went back from {known} generations to {done}"
    assert len(lines) >= done, f"the checkpoint has {done} generations, and the log {len(lines)}"
    assert whole["metrics.jsonl"].startswith(b"".join(lines)), "the log is not the uninterrupted run's"
    timed = [json.loads(line)["generation"] for line in whole_lines(run / "timing.jsonl")]
    assert timed == sorted(set(timed)), "timings are told twice"
    config = RunDirectory(run).read_config()
    for role, number in product(ROLES, kept_generations(done, config.esp.hof_size)):
        assert RunDirectory(run).champion_file(role, number).exists(), f"{role} {number} are gone"
    for file in (run / "champions").glob("[!.]*"):
        expected = whole.get(f"champions/{file.name}")  # None for one that the hall of fame drops later
        assert expected in (None, file.read_bytes()), f"{file.name} is not the uninterrupted run's"
        Team.load(file)
    return len(lines) - done


def state(run: Path) -> str:
    """How far a run is, in words."""
    if not run.exists():
        return NOTHING
    if not RunDirectory(run).config_file.exists():
        return "a directory without a config"
    done, lines = checkpointed(run), logged(run)
    if not lines:
        return "a config, no generation"
    if done == RunDirectory(run).read_config().generations:
        return WHOLE
    if not done:
        return "generations, no checkpoint"
    return "a checkpoint, and generations after it" if lines > done else "a checkpoint, and nothing after it"
