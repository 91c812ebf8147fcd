"""Names for the values that rules compute with, so that a signature says what a rule takes."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np

Value: TypeAlias = Any
"""A number, or sixteen numbers side by side (:class:`predprey_env.jit.lanes.Lanes`)."""

Values: TypeAlias = tuple[Value, ...]
"""Several values; compiled code knows their number from the tuple's type."""

Mask: TypeAlias = Any
"""A boolean, or sixteen side by side."""

FloatRows: TypeAlias = np.ndarray
"""float32 ``(rows,)`` for one world or ``(rows, LANES)`` for a block of worlds: each row is a :data:`Value`."""

IntegerRows: TypeAlias = np.ndarray
"""int32 ``(rows,)`` for one world or ``(rows, LANES)`` for a block of worlds: each row is a :data:`Value`."""

Array: TypeAlias = np.ndarray
"""An array of another shape, which the docstring states."""
