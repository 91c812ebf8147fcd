"""Look-up of an experiment's parts by name: classes of this project, and a user's own as ``module:Class``."""

from __future__ import annotations

import difflib
import importlib
import inspect
import sys
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

from predprey_env.settings import PartError, error_line


def import_here(name: str) -> ModuleType:
    """Import a module, also from the current directory, as ``python -m`` does."""
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.insert(0, here)
    return importlib.import_module(name)


def find_class(part: str, name: str, known: Mapping[str, str]) -> type[Any]:
    """Return the class of a part by its name in ``known``, or as ``module:Class``.

    Args:
        part: What the class is for, as the config and error messages name it.
        name: Name of the class.
        known: Name -> class of this project, as ``module:Class``.

    Raises:
        PartError: The class cannot be imported, or the object is no class; the message is one line.
        ValueError: The name is unknown; the message is one line.
    """
    place = known.get(name, name)
    if ":" not in place:
        near = difflib.get_close_matches(name, known, n=1)
        hint = f"; did you mean {near[0]}?" if near else ""
        raise ValueError(f"{part} must be one of {', '.join(known)} or module:Class, got {name!r}{hint}")
    found = find_object(part, place, name)
    if not inspect.isclass(found):
        raise PartError(f"{part} {name} must be a class, got {type(found).__name__}")
    return found


def find_object(part: str, place: str, name: str = "") -> Any:
    """Return an object of a module.

    Args:
        part: What the object is for, as the config and error messages name it.
        place: Module and name of the object, as ``module:name``.
        name: Name of the object in error messages; by default ``place``.

    Raises:
        PartError: The object cannot be imported; the message is one line.
    """
    module, _, attribute = place.partition(":")
    needed = f"{part} {name or place} cannot be imported"
    try:
        found = import_here(module)
    except (Exception, SystemExit) as error:  # a script that is imported may exit
        hint = f"; write {module[:-3]}:{attribute}, without .py" if module.endswith(".py") else ""
        raise PartError(f"{needed}: {error_line(error)}{hint}") from None
    try:
        return getattr(found, attribute)
    except AttributeError as error:
        near = difflib.get_close_matches(attribute, vars(found), n=1)
        hint = f"; did you mean {near[0]}?" if near else ""
        raise PartError(f"{needed}: {error_line(error)}{hint}") from None


def call_method(what: str, part: object, method: str, *arguments: object) -> Any:
    """Return what a method of a user's part returns.

    Args:
        what: The part in error messages, as ``network my_module:Net``.
        part: The object that has the method.
        method: Name of the method.
        *arguments: Its arguments.

    Raises:
        ValueError: The method raised an exception; the message is one line.
    """
    try:
        return getattr(part, method)(*arguments)
    except Exception as error:
        raise ValueError(f"{method}() of {what} raised {error_line(error)}") from None
