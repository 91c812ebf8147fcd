"""Small sweeps, and what is on disk after them."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


@pytest.fixture(scope="session")
def declare() -> Callable[..., Path]:
    """``declare(file, seeds=2, generations=6)``: write the file of a sweep of two cells."""

    def write(file: Path, seeds: int = 2, generations: int = 6) -> Path:
        fields = f"generations = {generations}\ncheckpoint_every = 2\nesp.n_trials = [40, 60]"
        file.write_text(f'preset = "smoke"\nseeds = {seeds}\n[fields]\n{fields}\n')
        return file

    return write


@pytest.fixture
def declared(declare: Callable[..., Path], tmp_path: Path) -> Callable[..., Path]:
    """``declared(seeds=2, generations=6)``: the file of a sweep of two cells, ``tmp_path / "sweep.toml"``."""
    return partial(declare, tmp_path / "sweep.toml")
