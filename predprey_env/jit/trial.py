"""Trial runs of a rule in Python, on rows that record which of them the rule read or wrote.

They are needed because compiled code checks no index: a rule that writes beyond its rows would damage memory, and end
the process.
"""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import Any

import numpy as np
from numba.core.registry import CPUDispatcher

from predprey_env.jit.sources import Function


class Rows(dict[int, Any]):
    """An array of one world, of unlimited length, that holds only the rows that were read or written.

    Args:
        fill: Function that returns what a row holds before it is written.
    """

    def __init__(self, fill: Callable[[int], Any]) -> None:
        super().__init__()
        self._fill = fill

    def __missing__(self, row: int) -> Any:
        value = self[row] = self._fill(row)
        return value

    def check(self, rule: str, called: str, n_rows: int) -> None:
        """Raise :class:`ValueError` if the rule touched a row that is not among the first ``n_rows``.

        ``rule`` and ``called`` name the rule and the array in the message.
        """
        if (row := next((row for row in sorted(self, reverse=True) if not 0 <= row < n_rows), None)) is not None:
            raise ValueError(f"{rule} must keep to the first {n_rows} rows of {called}, got row {row}")


def try_rule(function: Function, *arguments: Any) -> tuple[bool, Any]:
    """Return whether a rule runs in Python on these arguments, and what it returns.

    Some rules that compile do not run on :class:`Rows`, so an error here says nothing about the rule.
    """
    try:
        with np.errstate(all="ignore"):
            return True, _uncompiled(function, {})(*arguments)
    except Exception:
        return False, None


def _uncompiled(function: Function, known: dict[Function, Function]) -> Function:
    """Return the Python function of a rule, which calls the Python functions of other rules."""
    source = getattr(function, "py_func", function)
    if source not in known:
        names = dict(source.__globals__)
        known[source] = FunctionType(source.__code__, names, source.__name__, source.__defaults__, source.__closure__)
        for name in source.__code__.co_names:
            if isinstance(names.get(name), CPUDispatcher):
                names[name] = _uncompiled(names[name], known)
    return known[source]
