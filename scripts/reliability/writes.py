"""Every command that writes, and what lies there before it."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from esp_trainer.cli.overrides import override
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.presets import preset
from esp_trainer.run.directory import RunDirectory
from esp_trainer.run.trainer import Trainer
from reliability.processes import succeeded
from reliability.runs import TINY, resume, tiny

GENERATIONS, EVERY = 6, 2


@dataclass(frozen=True)
class Write:
    """A command that writes."""

    command: list[object]
    after: str = "nothing"
    """Which of the :func:`materials` lies there before."""
    again: list[object] | None = None
    """What goes on where a run has begun; None where the command itself is given again."""
    dense: int = 8
    """Up to so many pages every number is tried; from there on steps grow."""


_PLAYED = ["--generations", 4, "--episodes", 8]
_OLDER = ["--generations", 3, "--episodes", 4]
_TEAMS = [f"run/champions/{role}-{GENERATIONS - 1:05d}.safetensors" for role in ("predators", "prey")]
_CLIP = ["replay", _TEAMS[0], "--against", _TEAMS[1], "--until", 12]
_BENCHMARK = ["benchmark", "--policy", "greedy_chase", "--role", "predators", "--task", "3v2", "--episodes", 4]
_TRAIN, _RESUME, _FOLLOWED = tiny("run", GENERATIONS, EVERY), resume("run"), ["--tensorboard"]

WRITES = {
    "train": Write(_TRAIN, again=_RESUME, dense=100),
    "train --tensorboard": Write([*_TRAIN, *_FOLLOWED], again=[*_RESUME, *_FOLLOWED], dense=100),
    "resume": Write(_RESUME, after="a killed run", dense=100),
    "resume --generations": Write(resume("run", "--generations", GENERATIONS + 3), after="a run", dense=100),
    "report": Write(["report", "run", *_PLAYED], after="all of it, older"),
    "analyse": Write(["analyse", "run", *_PLAYED], after="a run"),
    "analyse --figures": Write(["analyse", "run", *_PLAYED, "--figures", "figures"], after="all of it, older"),
    "behaviours --csv": Write(["behaviours", "run", *_PLAYED, "--csv", "rates.csv"], after="all of it, older"),
    "benchmark": Write([*_BENCHMARK, "--out", "bench", "--leaderboard", "board.md"], after="all of it, older"),
    "replay --gif": Write([*_CLIP, "--gif", "clip.gif"], after="all of it, older"),
    "replay --mp4": Write([*_CLIP, "--mp4", "clip.mp4"], after="all of it, older"),
}


def materials(place: Path) -> dict[str, Path]:
    """Directories with what may lie there before: nothing; a run that was killed; one that is done; and one with older
    files of everything that the commands make.
    """
    made = {name: place / name for name in ("nothing", "a killed run", "a run", "all of it, older")}
    for name in ("nothing", "a killed run", "a run"):
        made[name].mkdir(parents=True)
    succeeded(_TRAIN, made["a run"])
    _kill(made["a killed run"] / "run", EVERY + 1)
    older = Path(shutil.copytree(made["a run"], made["all of it, older"]))
    for command in (
        ["report", "run", *_OLDER],
        ["analyse", "run", *_OLDER, "--figures", "figures"],
        ["behaviours", "run", *_OLDER, "--csv", "rates.csv"],
        [*_BENCHMARK, "--seed", 1, "--out", "bench", "--leaderboard", "board.md"],
        [*_CLIP, "--seed", 1, "--gif", "clip.gif"],
        [*_CLIP, "--seed", 1, "--mp4", "clip.mp4"],
    ):
        succeeded(command, older)
    return made


def _kill(run: Path, generations: int) -> None:
    """A run that stops without a word after some generations."""
    fields = [*TINY, "--generations", GENERATIONS, "--checkpoint_every", EVERY]
    config = override(preset("smoke"), list(map(str, fields)))
    trainer = Trainer.start(RunDirectory(run), config, lambda config: FusedEvaluator(config.env))
    for _ in islice(trainer.generations(), generations):
        pass
