"""Functions of several rules: which one is called depends on the class of the first argument."""

from __future__ import annotations

from functools import partial
from typing import Any

from predprey_env.settings import brief


class Generic:
    """A function whose rule depends on exactly the class of its first argument, in Python as in compiled code.

    Args:
        name: Name of the function, as error messages give it.
        kind: What the first argument is.
        default: Rule for classes that have none of their own; None if they must have one.
    """

    def __init__(self, name: str, kind: str = "player", default: Any = None) -> None:
        self.registry: dict[Any, Any] = {}
        self.default = default
        self._name, self._kind = name, kind

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
        if self.registry.setdefault(cls, rule) is not rule:
            raise ValueError(f"{cls.__name__} has a rule already; define the class anew to give it another")
        taken = {other.__name__ for other in self.registry if other is not cls}
        while cls.__name__ in taken:
            cls.__name__ += "_"
        return rule

    def known(self, one: Any) -> Any:
        """Return the rule for the class of an object; :class:`TypeError` if it has none."""
        rule = self.registry.get(type(one))
        if rule is None:
            raise TypeError(f"{self._kind} must be of a class that {self._name}() knows, got {type(one).__name__}")
        return rule
