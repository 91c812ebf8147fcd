"""Why mutants that no test kills may live, as ``mutation.toml`` says."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from typing import NamedTuple

from mutants.modules import ROOT
from mutants.session import Mutant

READ = ROOT / "tests" / "mutation" / "mutation.toml"


class Reading(NamedTuple):
    """Why mutants that no test kills may live."""

    module: str
    function: str
    becomes: list[str]
    """The changed lines."""
    why: str
    equivalent: bool = True
    """Whether nobody could tell such a mutant from the original; else it is merely let live."""


def read_known() -> list[Reading]:
    """Return all readings."""
    return [Reading(**entry) for entry in tomllib.loads(READ.read_text())["read"]]


def reading(module: str, mutant: Mutant, known: Sequence[Reading]) -> Reading | None:
    """Return what was read of a mutant."""
    place = module, mutant.function
    return next(
        (read for read in known if (read.module, read.function) == place and mutant.becomes in read.becomes), None
    )
