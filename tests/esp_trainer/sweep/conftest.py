"""Small sweeps, and what is on disk after them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


@pytest.fixture
def declared(tmp_path: Path) -> Callable[..., Path]:
    """``declared(seeds=2, generations=6)``: the file of a sweep of two cells."""

    def write(seeds: int = 2, generations: int = 6) -> Path:
        file = tmp_path / "sweep.toml"
        fields = f"generations = {generations}\ncheckpoint_every = 2\nesp.n_trials = [40, 60]"
        file.write_text(f'preset = "smoke"\nseeds = {seeds}\n[fields]\n{fields}\n')
        return file

    return write


@pytest.fixture(scope="session")
def snapshot() -> Callable[[Path], dict[str, bytes]]:
    """``snapshot(path)``: the bytes of every file but ``timing.jsonl``, which holds wall seconds."""

    def read(path: Path) -> dict[str, bytes]:
        files = (file for file in sorted(path.rglob("*")) if file.is_file() and file.name != "timing.jsonl")
        return {str(file.relative_to(path)): file.read_bytes() for file in files}

    return read
