"""The table of claims."""

from __future__ import annotations

from reproduction.claims import Verdict
from reproduction.report.words import p_value


def claims(verdicts: list[Verdict]) -> str:
    """A row for each claim."""
    rows = [
        f"| {v.claim.section} | {v.claim.says} | {v.claim.measure} | {_difference(v)} | {v.found.effect:+.2f} | {p_value(v.p)} "
        f"| **{v.word}** | [{v.claim.figure}](reproduction/{v.claim.figure}.png) |"
        for v in verdicts
    ]
    words = [v.word for v in verdicts]
    tally = ", ".join(f"{words.count(word)} {word}" for word in ("supported", "not supported", "undecided"))
    return f"""## The paper's claims

{tally}. *Effect* is Cliff's delta, *p* is corrected for all {len(verdicts)} claims (Holm). How a verdict is reached stands
under [How it was measured](#how-it-was-measured).

| section | the paper says | measured | value [95% interval] | effect | p | verdict | figure |
| --- | --- | --- | --- | --- | --- | --- | --- |
""" + "\n".join(rows)


def _difference(verdict: Verdict) -> str:
    found = verdict.found
    return f"{found.difference:+.3f} [{found.low:+.3f}, {found.high:+.3f}]"
