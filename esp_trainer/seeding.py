"""Random streams, one for each purpose in each generation.

Every purpose of every generation has its own generator. Its numbers therefore do not depend on what else was sampled,
on the number of threads or workers, or on whether the run was resumed.
"""

from __future__ import annotations

import zlib

import numpy as np


def stream(seed: int, purpose: str, generation: int = 0) -> np.random.Generator:
    """Return the random generator for a purpose in a generation of the run with this seed."""
    key = (zlib.crc32(purpose.encode()), generation)
    return np.random.Generator(np.random.Philox(np.random.SeedSequence(seed, spawn_key=key)))
