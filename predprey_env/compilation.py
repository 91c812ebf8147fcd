"""Numba entry points, cached on disk under a digest of every source file that they are compiled from.

Numba's own cache looks only at the file of the outermost function. Here that function inlines rules from other files,
and an edited rule must never be answered with yesterday's machine code.
"""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

from numba import njit
from numba.core.caching import FunctionCache
from numba.core.registry import CPUDispatcher

from predprey_env import floats, lanes

Compiled = TypeVar("Compiled", bound=Callable[..., Any])


def source_files(function: Callable[..., Any]) -> set[str]:
    """The files of a function, of every compiled function that it calls, directly or not, and of the named tuples that
    they know: Numba tells those apart by class alone, not by their fields.
    """
    files, pending = {__file__, floats.__file__, lanes.__file__}, [function]
    seen: set[Callable[..., Any]] = set()
    while pending:
        current = pending.pop()
        seen.add(current)
        files.add(inspect.getfile(current))
        known = current.__globals__
        files |= {
            inspect.getfile(value) for value in known.values() if hasattr(value, "_fields") and inspect.isclass(value)
        }
        named = (known.get(name) for name in current.__code__.co_names)
        pending += [value.py_func for value in named if isinstance(value, CPUDispatcher) and value.py_func not in seen]
    return files


class _DigestCache(FunctionCache):
    """Numba's cache with the digest of all sources in the key."""

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        digest = hashlib.sha256()
        for file in sorted(source_files(function)):
            digest.update(Path(file).read_bytes())
        self._digest = digest.hexdigest()

    def _index_key(self, signature: Any, codegen: Any) -> Any:
        return super()._index_key(signature, codegen), self._digest


def rule(function: Compiled) -> Compiled:
    """Compile a function that other compiled functions call; it becomes part of them.

    Rules allocate nothing (and could not: Numba's reference counts, switched off here, cost more than the rules do).
    """
    return njit(nogil=True, _nrt=False, forceinline=True)(function)  # type: ignore[no-any-return]


def entry_point(function: Compiled) -> Compiled:
    """Compile a function that Python calls, keep the machine code on disk, and let threads run it at the same time.

    It allocates nothing either; callers pass it the memory it works in.
    """
    dispatcher = njit(nogil=True, _nrt=False)(function)
    with suppress(RuntimeError):  # no place on this machine that can be written to: compile each time
        dispatcher._cache = _DigestCache(function)
    return dispatcher  # type: ignore[no-any-return]
