"""What a claim is, and the rule that gives the verdict.

A claim that something is more (or less) is not supported where the whole 95% interval stays below the smallest
difference that would matter, or where the test, corrected for all claims by Holm's method, finds the contrary at 0.05;
supported where the test finds it; else undecided. A claim that nothing changes is supported where the whole interval is
within that difference of 0, and not supported where the test finds a change that is larger.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from esp_trainer.analysis.inference import Comparison, holm
from reproduction.results import Results

All = Mapping[str, Results]


@dataclass(frozen=True)
class Claim:
    """One row of the table."""

    section: str
    says: str
    arms: tuple[str, ...]
    """What it needs."""
    measure: str
    """What the number is, in words."""
    number: Callable[[All], Comparison]
    direction: int
    """1: the difference must be above 0, -1: below, 0: no difference."""
    margin: float
    figure: str


@dataclass(frozen=True)
class Verdict:
    """What came of a claim."""

    claim: Claim
    found: Comparison
    p: float
    """Corrected for all claims that were tested."""

    @property
    def word(self) -> str:
        """Supported, not supported or undecided, by the rule above."""
        found, margin = self.found, self.claim.margin
        sure = self.p < 0.05
        if self.claim.direction == 0:
            if -margin < found.low and found.high < margin:
                return "supported"
            return "not supported" if sure and abs(found.difference) > margin else "undecided"
        towards = self.claim.direction
        most = found.high if towards > 0 else -found.low
        if most < margin or (sure and found.difference * towards < 0):
            return "not supported"
        return "supported" if sure else "undecided"


def verdicts(claims: Iterable[Claim], results: All) -> list[Verdict]:
    """All claims whose arms are there."""
    tested = [claim for claim in claims if all(arm in results for arm in claim.arms)]
    found = [claim.number(results) for claim in tested]
    corrected = holm([test.p for test in found]) if found else []
    return [Verdict(*row) for row in zip(tested, found, map(float, corrected), strict=True)]
