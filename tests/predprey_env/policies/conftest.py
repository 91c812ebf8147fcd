"""What the tests of the policies share: views written by hand."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

if TYPE_CHECKING:
    from collections.abc import Callable


@pytest.fixture(scope="session")
def offsets() -> Callable[..., np.ndarray]:
    """``offsets((5, 1), (0, -8))``: what an agent sees of two opponents."""

    def make(*pairs: tuple[int, int]) -> np.ndarray:
        return np.array(pairs, np.float32).ravel()

    return make
