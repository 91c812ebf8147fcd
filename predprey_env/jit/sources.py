"""The source files that machine code depends on, as they were when their rules were defined."""

from __future__ import annotations

import ast
import functools
import hashlib
import inspect
import os
import sys
from collections.abc import Callable, Iterable
from importlib.util import resolve_name
from pathlib import Path
from typing import Any, TypeAlias

from numba import types
from numba.core.registry import CPUDispatcher

from predprey_env.jit import floats, lanes, linking

Function: TypeAlias = Callable[..., Any]

_COMPILATION = str(Path(__file__).with_name("compilation.py"))
"""The file that defines how rules are compiled, on which all machine code depends."""
_DEFINED: dict[str, bytes] = {}
"""Content of each file with a rule at the time when the rule was defined.

If a file were read only when its rule is compiled, and had been edited since the rule was defined, the machine code of
the old rule would be cached as that of the new one."""


def remember(function: Function) -> None:
    """Store the content of the file of a function that is being defined."""
    file = file_of(function)
    if Path(file).is_file():
        _DEFINED[file] = Path(file).read_bytes()


def _source(file: str) -> bytes:
    if file in _DEFINED:
        return _DEFINED[file]
    # Code in no file (in a notebook's cell, for example) gets random bytes, so that its digest never matches.
    return Path(file).read_bytes() if Path(file).is_file() else os.urandom(16)


def source_files(function: Function, classes: Iterable[type] = ()) -> set[str]:
    """Return the files that a function's machine code depends on.

    They are the files of:

    - the function, and every compiled function that it calls, directly or not;
    - the modules from which these functions use a name (a constant, for example);
    - the named tuples among their globals, because Numba tells named tuples apart by class, not by their fields;
    - ``classes``, and, where a generic function is called, its rules for ``classes`` and for the named tuples that the
      functions make.
    """
    files, pending = {_COMPILATION, floats.__file__, lanes.__file__, linking.__file__}, [function]
    files |= {file_of(known) for known in classes}
    seen: set[Function] = set()
    kinds, generics = set(classes), list[Any]()
    while pending:
        current = pending.pop()
        seen.add(current)
        files.add(file_of(current))
        known = current.__globals__
        files |= {file_of(value) for value in known.values() if hasattr(value, "_fields") and inspect.isclass(value)}
        used = current.__code__.co_names
        imported = {module for name, module in _imports(_source(file_of(current))) if name in used}
        files |= {file for module in imported if (file := _file_of_module(module, known.get("__package__")))}
        called: list[Any] = [known.get(name) for name in used]
        for module in [value for value in called if inspect.ismodule(value)]:
            files.add(file_of(module))
            called += [getattr(module, name, None) for name in used]
        kinds |= {value for value in called if inspect.isclass(value) and hasattr(value, "_fields")}
        generics += [value for value in called if hasattr(value, "registry")]
        for generic in generics:
            called += [generic.default, *(rule for kind, rule in generic.registry.items() if kind in kinds)]
        pending += [value.py_func for value in called if isinstance(value, CPUDispatcher) and value.py_func not in seen]
    return files


def file_of(defined: Any) -> str:
    """Return the file that defines a function or a class; if there is none, a text that no file has as its name."""
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

    A name has several modules if the source tries a second import when the first fails.
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


def digest(function: Function, signature: Iterable[types.Type]) -> str:
    """Return the digest of all sources of a function's machine code for some types of arguments."""
    found = hashlib.sha256()
    for file in sorted(source_files(function, named_tuples(signature))):
        found.update(_source(file))
    return found.hexdigest()
