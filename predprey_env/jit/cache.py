"""Machine code on disk, under a digest of every source file that it is compiled from.

Numba's own cache checks only the file of the outermost function. Here that function inlines rules from other files, and
an edited rule must never run with machine code compiled before the edit.
"""

from __future__ import annotations

import secrets
import warnings
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from hashlib import sha256
from pathlib import Path
from typing import Any

import numba
from numba import types
from numba.core import caching

from predprey_env.jit.exclusion import alone
from predprey_env.jit.sources import Function, digest, file_of


def in_words(kind: types.Type) -> str:
    """Return a unique name of a type, which holds the full names of its classes."""
    if not isinstance(kind, types.BaseTuple):
        return str(kind)
    of = kind.instance_class if isinstance(kind, types.BaseNamedTuple) else tuple
    return f"{of.__module__}.{of.__qualname__}({', '.join(map(in_words, kind.types))})"


_DAMAGED = (
    *(ImportError, AttributeError),  # the index names a class that no longer exists, perhaps that of another version
    *(EOFError, caching.pickle.UnpicklingError),  # the machine lost power while the index was written
)

_warned = False


def _warn(why: str) -> None:
    """Warn, once in a process, that machine code is not cached."""
    global _warned
    if not _warned:
        line = f"machine code is not kept, and compiled again each time: {why}"
        line += "; set NUMBA_CACHE_DIR to a writable directory"
        warnings.warn_explicit(line, RuntimeWarning, "predprey_env", 0)  # printed in one line, without a line of source
        _warned = True


class _FilesOfEachProcess(caching.IndexDataCacheFile):
    """Files of machine code with names that no other process uses.

    Numba numbers the files in the order in which they are saved. Two processes that save at once can use the same
    number, and the index then names the machine code of one signature as that of another.
    """

    def save(self, key: object, data: object) -> None:
        """Save machine code under a key: first the code, then the index that names its file."""
        name = self._load_index().get(key) or self._data_name(secrets.randbits(48))
        self._save_data(name, data)
        self._save_index(self._load_index() | {key: name})

    def _load_index(self) -> dict[object, str]:
        """Return the file of each key. A damaged index counts as empty."""
        try:
            return super()._load_index()
        except _DAMAGED:
            return {}


class DigestCache(caching.FunctionCache):
    """Numba's cache with the digest of all sources in the key. A cache that cannot be read or written does not stop the
    program.

    Keys are strings. Numba's own keys hold types, and a process that cannot import the class of a single type cannot
    read the index at all: it would compile everything again and overwrite the index of the other processes.
    """

    def __init__(self, function: Function) -> None:
        super().__init__(function)
        locator, base = self._impl.locator, self._impl.filename_base
        self._cache_file = _FilesOfEachProcess(self._cache_path, base, locator.get_source_stamp())

    def load_overload(self, sig: object, target_context: object) -> object:
        """Return the machine code for a signature, or None."""
        with self._as_far_as_possible():
            try:
                return super().load_overload(sig, target_context)
            except _DAMAGED:
                self.flush()
        return None

    def alone(self, signature: object, target_context: Any) -> AbstractContextManager[None]:
        """Let one process at a time compile for a signature: the next finds its machine code."""
        key = sha256(repr(self._index_key(signature, target_context.codegen())).encode())
        with suppress(OSError):
            self._impl.locator.ensure_cache_path()
        return alone(Path(self._cache_path, f"{self._impl.filename_base}.lock"), int(key.hexdigest()[:7], 16))

    def save_overload(self, sig: object, data: object) -> None:
        """Write machine code to the cache, if the disk allows."""
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
        words = tuple(map(in_words, signature))
        return super()._index_key(words, codegen), digest(self._py_func, signature)


class NoCache(caching.NullCache):
    """A cache that stores nothing."""

    def __init__(self, function: Function) -> None:
        self._file = file_of(function)

    def alone(self, _signature: object, _target_context: object) -> AbstractContextManager[None]:
        """Let every process compile for itself, as none finds what another has compiled."""
        return nullcontext()

    def load_overload(self, _sig: object, _target_context: object) -> None:
        """Return None, and warn that the code is compiled at every start although a writable directory would prevent
        it.
        """
        if Path(self._file).is_file():  # a function in a notebook's cell, for example, cannot be cached at all
            given = numba.config.CACHE_DIR
            _warn(f"{given} cannot be written to" if given else "there is no place for it")
