"""The damaged and hostile files of ``tests/esp_trainer/test_fuzz.py``, counted."""

from __future__ import annotations

import functools
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

TESTS = Path(__file__).parents[2] / "tests/esp_trainer/test_fuzz.py"


class _Count:
    """Counts what the tests' ``outcome`` is asked, by what it reads, and how often it refuses."""

    def __init__(self) -> None:
        self.files: Counter[str] = Counter()
        self.refused: Counter[str] = Counter()

    def pytest_collection_modifyitems(self, items: Sequence[pytest.Item]) -> None:
        """Come between each test module and its ``outcome``."""
        for module in {item.module for item in items if isinstance(item, pytest.Function)}:
            module.outcome = self._counted(module.outcome)

    def _counted(self, outcome: Any) -> Any:
        @functools.wraps(outcome)
        def call(read: Any, file: Path) -> Any:
            found = outcome(read, file)
            self.files[read.__name__] += 1
            self.refused[read.__name__] += found is None
            return found

        return call


def fuzz(*options: str) -> dict[str, Any]:
    """Run the tests; :class:`RuntimeError` unless they pass."""
    count, begun = _Count(), time.perf_counter()
    code = pytest.main([str(TESTS), "-q", "-m", "", "-n", "0", *options], plugins=[count])
    if code:
        raise RuntimeError(f"{TESTS.name} ended with {code}")
    seconds = round(time.perf_counter() - begun, 1)
    return {"files": dict(count.files), "refused": dict(count.refused), "seconds": seconds}
