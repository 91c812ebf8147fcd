"""The claims of the paper (``claims.toml``): a number for each seed, a test, and the rule that gives the verdict.

A claim that something is more is not supported where the whole 95% interval stays below the smallest difference that
would matter, or where the test, corrected for all claims by Holm's method, finds the contrary at 0.05; supported where
the test finds it; else undecided. A claim that nothing changes is supported where the whole interval is within that
difference of 0, and not supported where the test finds a change that is larger.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import binomtest

from esp_trainer.analysis.inference import Comparison, against, compare, holm
from reproduction.results import CHANCE, StudyResults

MEASURED_NUMBERS: dict[str, Callable[[StudyResults, str], np.ndarray]] = {
    "late": lambda results, of: results.late(of),
    "progress": lambda results, _: results.two_sided(),
    "late progress": lambda results, _: results.two_sided(since=results.halfway),
    "behaviour": lambda results, of: np.nanmean(results.behaviour(of), axis=1),
    "escapes": lambda results, _: 1 - results.late_share("panel.prey"),
    "against scripts": lambda results, _: results.late_share("scripts.predators"),
}
"""A number for each seed of a setting."""


@dataclass(frozen=True)
class Claim:
    """A row of the table."""

    section: str
    says: str
    settings: list[str]
    number: str
    """One of :data:`MEASURED_NUMBERS`, or ``cycles``."""
    measured: str
    """The number's meaning, in words."""
    expects: str
    """``more`` or ``no change``."""
    margin: float
    """The smallest difference that would matter."""
    figure: str
    of: str = ""
    beyond: float = 0.0


@dataclass(frozen=True)
class Verdict:
    """The verdict on a claim."""

    claim: Claim
    found: Comparison
    p: float
    """Corrected for all claims that were tested."""

    @property
    def word(self) -> str:
        """Supported, not supported or undecided, by the rule above."""
        found, margin, sure = self.found, self.claim.margin, self.p < 0.05
        if self.claim.expects == "no change":
            if -margin < found.low and found.high < margin:
                return "supported"
            return "not supported" if sure and abs(found.difference) > margin else "undecided"
        if found.high < margin or (sure and found.difference < 0):
            return "not supported"
        return "supported" if sure else "undecided"


def read_claims() -> list[Claim]:
    """Return all claims, in the order of the paper."""
    declared = tomllib.loads(Path(__file__).with_suffix(".toml").read_text())
    return [Claim(**entry) for entry in declared["claim"]]


def verdicts(claims: Iterable[Claim], results: Mapping[str, StudyResults]) -> list[Verdict]:
    """Test the claims whose settings are there."""
    tested = [claim for claim in claims if all(name in results for name in claim.settings)]
    found = [test(claim, [results[name] for name in claim.settings]) for claim in tested]
    corrected = holm([each.p for each in found]) if found else []
    return [Verdict(*row) for row in zip(tested, found, map(float, corrected), strict=True)]


def test(claim: Claim, results: list[StudyResults]) -> Comparison:
    """Test one setting against a number, or two settings against each other."""
    if claim.number == "cycles":
        return _cycles(results[0])
    values = [MEASURED_NUMBERS[claim.number](each, claim.of) for each in results]
    return against(values[0], claim.beyond) if len(values) == 1 else compare(*values)


def _cycles(results: StudyResults) -> Comparison:
    """Test in how many seeds success makes cycles, beyond the 1 in 20 in which chance does: exact and binomial."""
    often = results.cycling()
    test = binomtest(sum(often), len(often), CHANCE)
    share, ends = float(np.mean(often)), test.proportion_ci(method="wilson")
    return Comparison(share - CHANCE, ends.low - CHANCE, ends.high - CHANCE, 2 * share - 1, float(test.pvalue))
