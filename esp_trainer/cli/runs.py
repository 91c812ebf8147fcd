"""Runs as the commands of the analysis read them."""

from __future__ import annotations

from pathlib import Path

from esp_trainer.analysis.history import History
from esp_trainer.analysis.pooling import (
    check_directories,
    check_same_config,
    cut_to_shortest,
    note_on_champions,
    note_on_lengths,
)
from esp_trainer.cli.streams import say
from esp_trainer.config import RunConfig


def check_world(command: str, run: Path, config: RunConfig) -> None:
    """Raise :class:`ValueError` if a run plays another game than a command is for."""
    if game := config.game.environment:
        raise ValueError(f"{command} is for the predator-prey world, got {run}, which plays {game}")


def read_runs(runs: list[Path]) -> list[History]:
    """Read runs, cut to their common generations; raise :class:`ValueError` if they cannot be measured together."""
    check_directories(runs)
    histories = [History.of_run(run) for run in runs]
    check_same_config([(run, history.config) for run, history in zip(runs, histories, strict=True)])
    cut = cut_to_shortest(histories)
    for note in filter(None, [note_on_lengths(list(map(len, histories))), note_on_champions(histories)]):
        say(f"note: {note}")
    return cut
