"""Options of an environment's ``reset``."""

from __future__ import annotations

import difflib
import re
from collections.abc import Collection, Mapping
from typing import Any, TypeAlias

from predprey_env.settings import brief

Options: TypeAlias = Mapping[str, Any]
"""Options of a reset, by name."""

OPTIONS = ("starts", "reset_mask")
"""Names of all options; `reset_mask` is only for environments with many worlds."""


def read_reset_options(options: object, known: Collection[str] = OPTIONS, *, only_ours: bool = False) -> dict[str, Any]:
    """Return the options of a reset by name.

    Raises :class:`ValueError` for a name that looks like a misspelt option of this package, and for an option that only
    its other environments have. Other unknown names are ignored, because they may be options of wrappers; with
    ``only_ours`` they are refused too.
    """
    if options is None:
        return {}
    if not isinstance(options, Mapping):
        raise ValueError(f"options must be a mapping from names to values, got {brief(options)}")
    for name in options:
        if name not in known and (near := _ours(str(name))):
            hint = f"did you mean {near}?" if near in known else f"only a vector environment has {near}"
            raise ValueError(f"unknown reset option {name}; {hint}")
        if name not in known and only_ours:
            raise ValueError(f"unknown reset option {name}; there are {' and '.join(known)}")
    return dict(options)


_SYNONYMS = {"starts": "(starts?|starting|cells?|positions?|_)+", "reset_mask": "masks?"}


def _ours(name: str) -> str | None:
    """Return the option of this package that a name resembles, or None."""
    meant = [option for option, pattern in _SYNONYMS.items() if re.fullmatch(pattern, name.lower())]
    near = difflib.get_close_matches(name.lower(), OPTIONS, n=1, cutoff=0.8)
    meant += [option for option in near if option[0] == name[0].lower()]  # "restarts" is not a misspelt "starts"
    return meant[0] if meant else None
