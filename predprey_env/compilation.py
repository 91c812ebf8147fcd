"""Numba entry points, cached on disk under a digest of every source file that they are compiled from.

Numba's own cache looks only at the file of the outermost function. Here that function inlines rules from other files,
and an edited rule must never be answered with yesterday's machine code.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import inspect
import os
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from importlib.util import resolve_name
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba import njit, types
from numba.core import caching
from numba.core.registry import CPUDispatcher

from predprey_env import floats, lanes

Compiled = TypeVar("Compiled", bound=Callable[..., Any])


def source_files(function: Callable[..., Any], classes: Iterable[type] = ()) -> set[str]:
    """The files of a function, of every compiled function that it calls, directly or not, of what these import and use,
    a number for example, and of the named tuples that they know: Numba tells those apart by class alone, not by their
    fields.

    Where a generic function is called, its rules for ``classes`` count.
    """
    files, pending = {__file__, floats.__file__, lanes.__file__}, [function]
    files |= {_file_of(known) for known in classes}
    seen: set[Callable[..., Any]] = set()
    while pending:
        current = pending.pop()
        seen.add(current)
        files.add(_file_of(current))
        known = current.__globals__
        files |= {_file_of(value) for value in known.values() if hasattr(value, "_fields") and inspect.isclass(value)}
        used = current.__code__.co_names
        imported = {module for name, module in _imports(_source(_file_of(current))) if name in used}
        files |= {file for module in imported if (file := _file_of_module(module, known.get("__package__")))}
        called: list[Any] = [known.get(name) for name in used]
        for module in [value for value in called if inspect.ismodule(value)]:
            files.add(_file_of(module))
            called += [getattr(module, name, None) for name in used]
        for generic in [value for value in called if hasattr(value, "registry")]:
            called += [rule for kind, rule in generic.registry.items() if kind in classes]
        pending += [value.py_func for value in called if isinstance(value, CPUDispatcher) and value.py_func not in seen]
    return files


def _file_of(defined: Any) -> str:
    """Where a function or a class is written, or something that is no file."""
    try:
        return inspect.getfile(defined)
    except (TypeError, OSError):
        return f"<{defined!r}>"


def _file_of_module(name: str, package: str | None) -> str | None:
    """Return the file of a module that is loaded, by its name as a package imports it."""
    try:
        return getattr(sys.modules.get(resolve_name(name, package)), "__file__", None)
    except ImportError:  # a relative import where there is no package: what an ``except ImportError`` is there for
        return None


@functools.cache
def _imports(source: bytes) -> set[tuple[str, str]]:
    """Return each name that a source imports, with its module, which has dots before it if it is relative.

    A name may have several modules, the second for when the first cannot be imported.
    """
    try:
        tree = ast.parse(source)  # bytes: the source itself says how they are encoded
    except (SyntaxError, ValueError):  # no Python: random bytes, or what somebody made of a file since it was imported
        return set()
    lines = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    return {(a.asname or a.name, "." * line.level + (line.module or "")) for line in lines for a in line.names}


def named_tuples(kinds: Iterable[types.Type]) -> set[type]:
    """The classes of all named tuples among some Numba types, and in them."""
    found: set[type] = set()
    for kind in kinds:
        if isinstance(kind, types.BaseNamedTuple):
            found |= {kind.instance_class}
        if isinstance(kind, types.BaseTuple):
            found |= named_tuples(kind.types)
    return found


_DAMAGED = (
    *(ImportError, AttributeError),  # the index knows a class, in somebody's experiment, that is gone
    *(EOFError, caching.pickle.UnpicklingError),  # the machine lost power when it was written
)

_warned = False


def _warn(why: str) -> None:
    """Tell, once in a process, that machine code is not kept."""
    global _warned
    if not _warned:
        line = f"machine code is not kept, and compiled again each time: {why}"
        line += "; set NUMBA_CACHE_DIR to a writable directory"
        warnings.warn_explicit(line, RuntimeWarning, __package__, 0)  # without a line of source, to be one line itself
        _warned = True


class _DigestCache(caching.FunctionCache):
    """Numba's cache with the digest of all sources in the key. Work need not end where it cannot be read or written."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The machine code for a signature, or None."""
        with self._as_far_as_possible():
            try:
                return super().load_overload(sig, target_context)
            except _DAMAGED:
                self.flush()
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep machine code, if there is room."""
        with self._as_far_as_possible():
            super().save_overload(sig, data)

    @contextmanager
    def _as_far_as_possible(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            self.disable()
            _warn(f"{self.cache_path}: {error.strerror or error}")

    def _index_key(self, signature: Any, codegen: Any) -> Any:
        digest = hashlib.sha256()
        for file in sorted(source_files(self._py_func, named_tuples(signature))):
            digest.update(_source(file))
        return super()._index_key(signature, codegen), digest.hexdigest()


class _NoCache(caching.NullCache):
    """Keeps nothing."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._file = _file_of(function)

    def load_overload(self, _sig: Any, _target_context: Any) -> None:
        """Nothing is there; who waits for a compilation now should know that the next start could be spared it."""
        if Path(self._file).is_file():  # else no directory would help: it is in a notebook's cell, for example
            given = numba.config.CACHE_DIR
            _warn(f"{given} cannot be written to" if given else "there is no place for it")


_DEFINED: dict[str, bytes] = {}
"""What each file with a rule held when the rule was defined. Were it read only when the rule is compiled, and edited in
between, the old rule's machine code would be kept as the new one's."""


def _remember(function: Callable[..., Any]) -> None:
    file = _file_of(function)
    if Path(file).is_file():
        _DEFINED[file] = Path(file).read_bytes()


def _source(file: str) -> bytes:
    if file in _DEFINED:
        return _DEFINED[file]
    # What is in no file, but in a notebook's cell for example, is never the same again.
    return Path(file).read_bytes() if Path(file).is_file() else os.urandom(16)


def rule(function: Compiled) -> Compiled:
    """Compile a function that other compiled functions call; it becomes part of them.

    Rules allocate nothing (and could not: Numba's reference counts, switched off here, cost more than the rules do).
    """
    _remember(function)
    return njit(nogil=True, _nrt=False, forceinline=True)(function)  # type: ignore[no-any-return]


def entry_point(function: Compiled) -> Compiled:
    """Compile a function that Python calls, keep the machine code on disk, and let threads run it at the same time.

    It allocates nothing either; callers pass it the memory it works in.
    """
    _remember(function)
    dispatcher = njit(nogil=True, _nrt=False)(function)
    try:
        dispatcher._cache = _DigestCache(function)
    except RuntimeError:  # no place on this machine that can be written to
        dispatcher._cache = _NoCache(function)
    return dispatcher  # type: ignore[no-any-return]
