"""Generic functions: the class of the first argument decides which rule is called."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from inspect import signature
from types import FunctionType
from typing import Any

import numba

from predprey_env.settings import brief


class Generic:
    """A function that calls the rule of its first argument's class, in Python as in compiled code.

    Rules are not inherited by subclasses.

    Args:
        name: Name of the function, as error messages give it.
        kind: Noun for the first argument in error messages.
        default: Rule for classes that have none of their own; None if they must have one.
    """

    compiled = True
    """Whether compiled code calls the rules, which then must be compiled too."""

    def __init__(self, name: str, kind: str = "player", default: Any = None) -> None:
        self.registry: dict[Any, Any] = {}
        self.default = default
        self._name, self._kind = name, kind

    __call__: Callable[..., Any]

    def register(self, cls: type, rule: Any = None) -> Any:
        """Register the rule of a class: ``choose.register(Player, rule)``, or ``@choose.register(Player)`` above the
        rule.

        When Numba looks for machine code, it tells named tuples apart by the name of their class, not by the class. A
        second class of the same name (a notebook's cell that is run again defines one) would be played by the rule of
        the first, so it is renamed.
        """
        if not (isinstance(cls, type) and issubclass(cls, tuple) and hasattr(cls, "_fields")):
            got = getattr(cls, "__name__", brief(cls))
            raise TypeError(f"{self._name}.register() needs the {self._kind}'s class first, a named tuple, got {got}")
        if rule is None:  # used as a decorator
            return partial(self.register, cls)
        if self.compiled and isinstance(rule, FunctionType) and not numba.config.DISABLE_JIT:
            place = f"put @rule below @{self._name}.register({cls.__name__})"
            raise TypeError(f"the rule of {cls.__name__} is not compiled: {place}")
        if self.registry.setdefault(cls, rule) is not rule:
            raise ValueError(f"{cls.__name__} has a rule already; define the class anew to give it another")
        taken = {other.__name__ for other in self.registry if other is not cls}
        while cls.__name__ in taken:
            cls.__name__ += "_"
        return rule

    def check(self, cls: type, called: str, calls: Iterable[str] = (), fields: Iterable[str] = ()) -> None:
        """Raise :class:`ValueError`, in one line, unless a class is a named tuple with a rule, some methods and fields.

        Args:
            cls: The class.
            called: Name of the class in error messages.
            calls: Names of the methods that it must have.
            fields: Names of the fields that it must have.
        """
        own = getattr(cls, "_fields", None)
        if own is None:
            raise ValueError(f"{called} must be a named tuple, got {cls.__name__}")
        missing = [field for field in fields if field not in own]
        missing += [f"{call}()" for call in calls if not callable(getattr(cls, call, None))]
        if missing:
            raise ValueError(f"{called} has no {' and no '.join(missing)}")
        if cls not in self.registry:
            raise ValueError(f"{called} has no rule: put @{self._name}.register({cls.__name__}) above it")
        rule = self.registry[cls]
        expected, got = ([*signature(f).parameters] for f in (self.__call__, getattr(rule, "py_func", rule)))
        if len(got) != len(expected):
            raise ValueError(f"the rule of {called} must take {', '.join(expected)}, got {', '.join(got)}")

    def in_python(self, one: Any) -> Any:
        """Return the Python function of the rule for the class of an object, or of the default."""
        rule = self.registry.get(type(one), self.default)
        return getattr(rule, "py_func", rule)

    def known(self, one: Any) -> Any:
        """Return the rule for the class of an object; raise :class:`TypeError` if it has none."""
        rule = self.registry.get(type(one))
        if rule is None:
            raise TypeError(f"{self._kind} must be of a class that {self._name}() knows, got {type(one).__name__}")
        return rule
