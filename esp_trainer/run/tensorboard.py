"""A run's log for TensorBoard, beside its own: the numbers of ``metrics.jsonl`` and ``timing.jsonl`` as scalars."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from gymnasium.error import DependencyNotInstalled


class TensorBoardLog:
    """Event files in a directory. A resumed run adds another; what both tell of a generation is the same.

    Raises :class:`gymnasium.error.DependencyNotInstalled` without the extra ``tensorboard``.
    """

    def __init__(self, directory: Path) -> None:
        check_installed()
        from tensorboard.summary import Writer

        directory.mkdir(parents=True, exist_ok=True)
        self._writer = Writer(str(directory))

    def add(self, record: Mapping[str, Any], seconds: Mapping[str, float]) -> None:
        """A generation: its line of the log, and its wall seconds by phase."""
        step = record["generation"]
        for name, number in (*_scalars(record), *_scalars(seconds, "seconds/")):
            self._writer.add_scalar(name, number, step)

    def close(self) -> None:
        """Write what is not yet written, and let the files go."""
        self._writer.close()


def check_installed() -> None:
    """Raise :class:`gymnasium.error.DependencyNotInstalled`, with what to do about it, if TensorBoard is not there."""
    try:
        import tensorboard.summary  # noqa: F401
    except ImportError:
        raise DependencyNotInstalled(
            'a log for TensorBoard needs tensorboard: install predprey-esp with its extra "tensorboard"'
        ) from None


def _scalars(tree: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, float]]:
    """The numbers of a tree by the way to them; of a rate with its interval the rate."""
    for name, value in tree.items():
        if isinstance(value, Mapping) and "rate" in value:
            yield prefix + name, value["rate"]
        elif isinstance(value, Mapping):
            yield from _scalars(value, f"{prefix}{name}/")
        elif isinstance(value, list):
            known = {str(i): each for i, each in enumerate(value) if each is not None}
            yield from _scalars(known, f"{prefix}{name}/")
        elif name != "generation":
            yield prefix + name, value
