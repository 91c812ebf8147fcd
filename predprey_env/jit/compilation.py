"""Numba entry points, cached on disk under a digest of every source file that they are compiled from.

Numba's own cache checks only the file of the outermost function. Here that function inlines rules from other files, and
an edited rule must never run with machine code compiled before the edit.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import inspect
import os
import re
import secrets
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from importlib.util import resolve_name
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

import numba
from numba import types
from numba.core import caching
from numba.core.errors import NumbaError
from numba.core.registry import CPUDispatcher

from predprey_env.jit import floats, lanes, linking
from predprey_env.jit.linking import INLINED, UNWRAPPED, RuleCompiler

Function: TypeAlias = Callable[..., Any]
Compiled = TypeVar("Compiled", bound=Function)


def source_files(function: Function, classes: Iterable[type] = ()) -> set[str]:
    """Return the files that a function's machine code depends on.

    These are the files of the function, of every compiled function that it calls, directly or not, of the modules whose
    names these use (a constant, for example), and of the named tuples that they know: Numba tells named tuples apart by
    class alone, not by their fields. If a generic function is called, its rules count for ``classes`` and for the
    named tuples that these functions make.
    """
    files, pending = {__file__, floats.__file__, lanes.__file__, linking.__file__}, [function]
    files |= {_file_of(known) for known in classes}
    seen: set[Function] = set()
    kinds, generics = set(classes), list[Any]()
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
        kinds |= {value for value in called if inspect.isclass(value) and hasattr(value, "_fields")}
        generics += [value for value in called if hasattr(value, "registry")]
        for generic in generics:
            called += [generic.default, *(rule for kind, rule in generic.registry.items() if kind in kinds)]
        pending += [value.py_func for value in called if isinstance(value, CPUDispatcher) and value.py_func not in seen]
    return files


def _file_of(defined: Any) -> str:
    """Return the file that defines a function or a class, or a text that names no file."""
    try:
        return inspect.getfile(defined)
    except (TypeError, OSError):
        return f"<{defined!r}>"


def _file_of_module(name: str, package: str | None) -> str | None:
    """Return the file of a loaded module, found by the name under which a package imports it."""
    try:
        return getattr(sys.modules.get(resolve_name(name, package)), "__file__", None)
    except ImportError:  # a relative import outside a package; the source itself catches the error
        return None


@functools.cache
def _imports(source: bytes) -> set[tuple[str, str]]:
    """Return each name that a source imports, with its module; a relative module begins with dots.

    A name may have several modules: the second serves when the first cannot be imported.
    """
    try:
        tree = ast.parse(source)  # bytes, because the source declares its own encoding
    except (SyntaxError, ValueError):  # not Python: random bytes, or a file that was edited after it was imported
        return set()
    lines = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    return {(a.asname or a.name, "." * line.level + (line.module or "")) for line in lines for a in line.names}


def named_tuples(kinds: Iterable[types.Type]) -> set[type]:
    """Return the classes of all named tuples among some Numba types, nested ones included."""
    found: set[type] = set()
    for kind in kinds:
        if isinstance(kind, types.BaseNamedTuple):
            found |= {kind.instance_class}
        if isinstance(kind, types.BaseTuple):
            found |= named_tuples(kind.types)
    return found


def in_words(kind: types.Type) -> str:
    """Return a name that no other type has, and that says its classes by their full names."""
    if not isinstance(kind, types.BaseTuple):
        return str(kind)
    of = kind.instance_class if isinstance(kind, types.BaseNamedTuple) else tuple
    return f"{of.__module__}.{of.__qualname__}({', '.join(map(in_words, kind.types))})"


_DAMAGED = (
    *(ImportError, AttributeError),  # a class that no longer exists is named, in an index of an earlier version too
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
    """Files of machine code whose names no other process takes.

    Numba numbers them in the order in which they are saved. Two processes that save at once can take the same number,
    and the index then names the machine code of one signature as that of another.
    """

    def save(self, key: object, data: object) -> None:
        """Save machine code under a key: first the code, then the index that names its file."""
        name = self._load_index().get(key) or self._data_name(secrets.randbits(48))
        self._save_data(name, data)
        self._save_index(self._load_index() | {key: name})

    def _load_index(self) -> dict[object, str]:
        """Return the file of each key. An index that is damaged is empty."""
        try:
            return super()._load_index()
        except _DAMAGED:
            return {}


class _DigestCache(caching.FunctionCache):
    """Numba's cache with the digest of all sources in the key. A cache that cannot be read or written does not stop the
    program.

    Keys are words alone. Numba's hold types, and a process that lacks the class of one cannot read the index at all: it
    would compile everything again and forget what the others know.
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

    def save_overload(self, sig: object, data: object) -> None:
        """Write machine code to the cache, if there is room."""
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
        return super()._index_key(tuple(map(in_words, signature)), codegen), digest.hexdigest()


class _NoCache(caching.NullCache):
    """A cache that stores nothing."""

    def __init__(self, function: Function) -> None:
        self._file = _file_of(function)

    def load_overload(self, _sig: object, _target_context: object) -> None:
        """Return None, and warn that the code is compiled at every start although a writable directory would prevent
        it.
        """
        if Path(self._file).is_file():  # a function in a notebook's cell, for example, cannot be cached at all
            given = numba.config.CACHE_DIR
            _warn(f"{given} cannot be written to" if given else "there is no place for it")


_DEFINED: dict[str, bytes] = {}
"""Content of each file with a rule at the time when the rule was defined.

If the file were read only when the rule is compiled, after an edit, the old rule's machine code would be cached as the
new one's."""


def _remember(function: Function) -> None:
    file = _file_of(function)
    if Path(file).is_file():
        _DEFINED[file] = Path(file).read_bytes()


def _source(file: str) -> bytes:
    if file in _DEFINED:
        return _DEFINED[file]
    # Code in no file (in a notebook's cell, for example) gets random bytes, so that its digest never matches.
    return Path(file).read_bytes() if Path(file).is_file() else os.urandom(16)


class _Rule(CPUDispatcher):
    """A compiled function for compiled callers. A call from Python is passed to a second one."""

    def __init__(self, function: Function) -> None:
        super().__init__(function, targetoptions=dict(UNWRAPPED), pipeline_class=RuleCompiler)
        self._for_python = CPUDispatcher(function, targetoptions=dict(INLINED))

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        return self._for_python(*arguments, **named)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return how a compiled caller calls it. A literal integer is compiled like any other integer."""
        plain = (types.unliteral(kind) if isinstance(kind, types.IntegerLiteral) else kind for kind in args)
        return super().get_call_template(tuple(plain), kws)


def rule(function: Compiled) -> Compiled:
    """Compile a function that other compiled functions call; it is inlined into them.

    Rules allocate nothing. They cannot: Numba's reference counts are switched off, because they cost more than the
    rules.
    """
    _remember(function)
    return function if numba.config.DISABLE_JIT else _Rule(function)


class _EntryPoint(CPUDispatcher):
    """A compiled function that Python calls. What does not compile is a :class:`ValueError`, in one line."""

    def __init__(self, function: Function) -> None:
        super().__init__(function, targetoptions={"nopython": True, "nogil": True, "_nrt": False})

    def _compile_for_args(self, *arguments: Any, **named: Any) -> Any:
        try:
            return super()._compile_for_args(*arguments, **named)
        except NumbaError as error:
            raise ValueError(_failure(error)) from error


def _failure(error: NumbaError) -> str:
    """Return what an error of Numba says in one line: the innermost rule, where in it, and what is wrong there."""
    text = re.sub(r"\x1b\[[0-9;]*m", "", str(error))
    inside, *callers = re.split(r"resolving callee type: type\(_Rule\(<function (\w+) ", text)  # the innermost first
    rule = f"the rule {callers[0]}" if callers else "a rule"
    place = re.search(r'File "([^"]+)", line (\d+)', inside)
    where = f" ({Path(place[1]).name}, line {place[2]})" if place else ""
    lines = [line.strip(" >") for line in text.splitlines() if line.strip()]
    at = max((i + 1 for i, line in enumerate(lines[:-1]) if line.startswith("Failed in")), default=0)
    reason = " ".join(lines[at : at + 2]) if lines[at].endswith(":") else lines[at]
    return f"{rule}{where} does not compile: {reason}"


def entry_point(function: Compiled) -> Compiled:
    """Compile a function that Python calls. Its machine code is cached on disk, and threads can run it at the same
    time.

    It allocates nothing either; callers pass the memory that it works in.
    """
    _remember(function)
    if numba.config.DISABLE_JIT:
        return function
    dispatcher = _EntryPoint(function)
    try:
        dispatcher._cache = _DigestCache(function)
    except RuntimeError:  # no cache directory on this machine can be written to
        dispatcher._cache = _NoCache(function)
    return dispatcher
