"""``train`` and ``resume``: a run on the terminal."""

from __future__ import annotations

import signal
import sys
from collections import deque
from pathlib import Path
from types import FrameType
from typing import Any

from tqdm import tqdm

from esp_trainer.coevolution.coevolution import Generation
from esp_trainer.config import RunConfig
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.run.directory import RunDirectory
from esp_trainer.run.trainer import Trainer
from esp_trainer.types import Evaluator

_BAR = "generation {n_fmt}/{total_fmt} {bar:20} {postfix} | {rate_inv_fmt}, {remaining} left"
_RECENT = 20  # generations in the closing summary


def train(config: RunConfig, out: Path | None, threads: int | None, *, quiet: bool) -> int:
    """Begin a run."""
    directory = RunDirectory(out or Path("runs") / f"{config.preset}-seed{config.seed}")
    trainer = Trainer.start(directory, config, lambda config: _evaluator(config, threads))
    return _run(trainer, quiet=quiet)


def resume(directory: Path, generations: int | None, threads: int | None, *, quiet: bool) -> int:
    """Go on with a run."""
    trainer = Trainer.resume(RunDirectory(directory), lambda config: _evaluator(config, threads), generations)
    if trainer.done == trainer.config.generations:
        _say(f"{directory} has all its {trainer.done} generations; give --generations to go on")
        return 0
    _say(f"going on with {directory} from generation {trainer.done}")
    return _run(trainer, quiet=quiet)


def _evaluator(config: RunConfig, threads: int | None) -> Evaluator:
    evaluator = FusedEvaluator(config.env, threads)
    _say("preparing the compiled kernel (some 10 s the first time, then from the cache) ...")
    evaluator.compile()
    return evaluator


def _run(trainer: Trainer, *, quiet: bool) -> int:
    caught_signal: list[int] = []

    def stop(number: int, _frame: FrameType | None) -> None:
        caught_signal.append(number)
        trainer.stop()

    handlers = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    recent: deque[Generation] = deque(maxlen=_RECENT)
    plain = quiet or not sys.stderr.isatty()
    try:
        with tqdm(
            total=trainer.config.generations, initial=trainer.done, unit="gen", bar_format=_BAR, disable=plain
        ) as bar:
            for generation in trainer.generations():
                recent.append(generation)
                bar.set_postfix_str(_success(generation), refresh=False)
                bar.update()
                if plain and trainer.done % trainer.config.checkpoint_every == 0:
                    _say(f"generation {trainer.done}/{trainer.config.generations}: {_success(generation)}")
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
    path = trainer.directory.path
    if caught_signal:
        _say(f"stopped after generation {trainer.done}; go on with: esp-trainer resume {path}")
        return 128 + caught_signal[0]
    _summarise(trainer, recent)
    return 0


def _success(generation: Generation) -> str:
    held_out = generation.held_out
    predators, prey = held_out.predators_succeed.rate, held_out.prey_succeed.rate
    return f"predators succeed {predators:.2f}, prey {prey:.2f}, caught {held_out.caught.rate:.2f}"


def _summarise(trainer: Trainer, recent: deque[Generation]) -> None:
    path, last = trainer.directory.path, trainer.done - 1

    def mean(values: list[float]) -> str:
        return f"{sum(values) / len(values):.2f}"

    print(f"{trainer.done} generations in {path}")
    if recent:
        caught = mean([g.held_out.caught.rate for g in recent])
        predators = mean([g.held_out.predators_succeed.rate for g in recent])
        prey = mean([g.held_out.prey_succeed.rate for g in recent])
        print(
            f"last {len(recent)} generations, champion against champion: {caught} of the prey caught; "
            f"predators catch all in {predators} of the episodes, prey all survive in {prey}"
        )
    files: dict[str, Any] = {role: trainer.directory.champion_file(role, last) for role in trainer.coevolution.evolving}
    first = files.get("predators") or files["prey"]
    against = files["prey"] if len(files) == 2 else trainer.config.prey.policy
    if "predators" not in files:
        against = trainer.config.predators.policy
    print(f"  the curves    {trainer.directory.metrics_file}")
    print(f"  the teams     {trainer.directory.champions}/")
    print(f"next:\n  esp-trainer replay {first} --against {against}")
    print(f"  esp-trainer evaluate {first} --against {against}")


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)
