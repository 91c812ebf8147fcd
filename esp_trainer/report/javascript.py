"""Translation of the rules to JavaScript, from the source that is compiled for the trainer.

The rules use a small subset of Python (see :mod:`predprey_env.jit.lanes`), so a small translator suffices. The page
therefore runs the same worlds, scripts and networks as the trainer, with all settings, and the two cannot drift apart.
Operations that JavaScript lacks (such as ``fma``) are in ``assets/floats.js``.

Numbers in JavaScript are 64-bit floats, so each result of arithmetic is rounded to 32 bits. For a sum, product or
quotient of 32-bit floats, this second rounding gives the same result as a single one (Figueroa, When is double rounding
innocuous?, 1995). Rounding does not change integers below 2**24. Only random choices need larger integers
(:mod:`~predprey_env.policies.chance`). Their products are taken modulo 2**32, which is enough because only their low 31
bits are used. Detectors of behaviours (:mod:`esp_trainer.analysis.behaviours`) compute with integers below 2**53 and
with 64-bit floats, which are JavaScript's own numbers, so nothing in them is rounded.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any

from esp_trainer.report.javascript_function import Translation, source_of


def translate(*rules: Callable[..., Any], classes: Collection[type] = (), exact: str | None = None) -> str:
    """Translate rules, and all rules that they call, to JavaScript functions of the same names.

    Args:
        rules: Rules to translate.
        classes: Classes of the first arguments of generic functions such as ``choose``. A generic function with a rule
            for only one of these classes becomes that rule. With several rules, it calls the one of the class that its
            first argument names as its ``kind``.
        exact: Package whose rules compute with JavaScript's own numbers, integers and 64-bit floats.

    Raises:
        ValueError: A rule is outside the subset of Python that rules are written in, or two rules have the same name.
    """
    pending = [source_of(rule) for rule in rules]
    found: dict[str, Callable[..., Any]] = {}
    texts: list[str] = []
    generics: dict[str, str] = {}
    while pending:
        function = pending.pop(0)
        name = function.__name__
        if name in found:
            if found[name] is not function:
                raise ValueError(f"two rules are called {name}: in {found[name].__module__} and {function.__module__}")
            continue
        found[name] = function
        translation = Translation(function, classes, exact)
        texts.append(translation.text)
        pending += translation.called
        generics |= translation.generics
    return "\n\n".join([*texts, *generics.values()]) + "\n"
