"""What is synced and renamed on disk, in order."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    import pytest


def spy(monkeypatch: pytest.MonkeyPatch, synced: Callable[[Path], None], renamed: Callable[[Path, Path], None]) -> None:
    """Tell of every file that is synced, and of every one that is about to be renamed to another."""
    fsync, replace = os.fsync, Path.replace

    def spy_fsync(descriptor: int) -> None:
        synced(Path(os.readlink(f"/proc/self/fd/{descriptor}")))  # noqa: PTH115
        fsync(descriptor)

    def spy_replace(path: Path, target: Path) -> Path:
        renamed(path, target)
        return replace(path, target)

    monkeypatch.setattr(os, "fsync", spy_fsync)
    monkeypatch.setattr(Path, "replace", spy_replace)
