"""A worker's part: begin or resume a run, and continue until it is complete."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from esp_trainer.config import RunConfig
from esp_trainer.evaluation.registry import make_evaluator
from esp_trainer.files import error_in_words, write_text
from esp_trainer.run.checkpoint import difference
from esp_trainer.run.directory import RunDirectory
from esp_trainer.run.trainer import Trainer
from esp_trainer.types import Evaluator


def carry_out(path: Path, config: RunConfig, started: Callable[[Trainer], object] = lambda _: None) -> str | None:
    """Carry out a run on one thread. ``started`` receives its trainer, and can stop it.

    Return None, or why the run failed, in one line. An unexpected exception leaves its traceback beside the run.
    """
    try:
        trainer = _trainer(path, config)
        started(trainer)
        for _ in trainer.generations():
            pass
    except OSError as error:
        return error_in_words(error)
    except (ValueError, MemoryError, Warning) as error:  # PYTHONWARNINGS can make an error of a warning
        return (str(error) or type(error).__name__).splitlines()[0]
    except Exception as error:
        log = path.with_name(f"traceback-{path.name}.txt")
        with suppress(OSError):
            write_text(log, traceback.format_exc())
        return f"{type(error).__name__}: {str(error).partition(chr(10))[0]}; see {log}"
    return None


def _trainer(path: Path, config: RunConfig) -> Trainer:
    directory = RunDirectory(path)
    if not directory.config_file.exists():
        return Trainer.start(directory, config, _evaluator)
    different = difference(directory.read_config().model_dump(), config.model_dump())
    if different:
        raise ValueError(f"{path} holds another run: {different} in the sweep")
    return Trainer.resume(directory, _evaluator, config.generations)


def _evaluator(config: RunConfig) -> Evaluator:
    return make_evaluator(config, threads=1)
