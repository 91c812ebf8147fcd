"""Random streams keyed by what they are for.

Each purpose of each generation has a generator of its own, so the numbers that it draws do not depend on what else was
drawn, on threads or workers, or on whether the run was resumed.
"""

from __future__ import annotations

import zlib

import numpy as np


def stream(seed: int, purpose: str, generation: int = 0) -> np.random.Generator:
    """The generator for a purpose in a generation of the run with this seed."""
    key = (zlib.crc32(purpose.encode()), generation)
    return np.random.Generator(np.random.Philox(np.random.SeedSequence(seed, spawn_key=key)))
