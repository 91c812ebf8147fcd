"""``docs/reproduction.md`` and its supplement: what the measurements say, as Markdown. Every number is made here."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from reproduction.claims import Verdict
from reproduction.report.behaviours import behaviours
from reproduction.report.claims import claims
from reproduction.report.parity import cycles, parity
from reproduction.report.race import curves, exploitable, games, progress
from reproduction.report.settings import sensitivity, settings, strongest
from reproduction.report.short_paper import abstract, body
from reproduction.results import Results


@dataclass(frozen=True)
class Origin:
    """Where a report came from."""

    command: str
    commit: str
    versions: str
    missing: tuple[str, ...] = ()
    """Settings that have not been run whole."""


def write(results: dict[str, Results], verdicts: Iterable[Verdict], origin: Origin) -> str:
    """Return the page: a short paper."""
    head = f"# The paper's experiments over many seeds\n\n{_made_by(results, origin)}"
    return "\n\n".join([head, abstract(results), body(results, list(verdicts))]) + "\n"


def write_supplement(results: dict[str, Results], verdicts: Iterable[Verdict], origin: Origin) -> str:
    """Return the supplement, which stands beside the figures: every claim and every setting in tables."""
    parts = [
        _head(results, origin),
        claims(list(verdicts)),
        curves(results),
        progress(results),
        parity(results),
        cycles(results),
        games(results),
        exploitable(results),
        behaviours(results),
        settings(results, "Ablations", ("paper", "ablation"), "ablations"),
        sensitivity(results),
        strongest(results),
        _method(),
    ]
    return "\n\n".join(part for part in parts if part).replace("](reproduction/", "](") + "\n"


def _head(results: dict[str, Results], origin: Origin) -> str:
    return f"""# Supplement: every claim and every setting

To [the paper's experiments over many seeds](../reproduction.md).

{_made_by(results, origin)}"""


def _made_by(results: dict[str, Results], origin: Origin) -> str:
    n_runs = sum(found.n_seeds for found in results.values())
    names = ", ".join(f"`{name}`" for name in origin.missing)
    missing = f"\n\n**Not run whole yet, and not in this report: {names}.**" if names else ""
    return f"""`{origin.command}` at commit {origin.commit}, {origin.versions}: {n_runs} runs of {len(results)} settings. This page and
its figures are made by that command; each figure's data lies beside it as CSV, and the measurements of every run in
[`data/`](reproduction/data).{missing}"""


def _method() -> str:
    return """## How it was measured

- **Runs.** Each setting with the seeds 0 and up, `modern` with 100 and up; the panel of held-out opponents from seeds 1000 to 1002 of the same world, half
  of them with raw and half with scaled offsets, three champions of each run. No run of a panel is part of a result.
- **Matches.** 64 episodes a pair, the same starts for all, holding the parities in their true proportions.
- **Intervals** over seeds are Student's for means; differences between settings are Hodges-Lehmann's with the interval of the rank
  test. **Tests**: sign flips for one setting against a number, Mann-Whitney between settings; Holm's correction over all claims.
- **Verdicts.** *Not supported*: the whole interval is below the smallest difference that would matter (0.05 of the prey or episodes,
  0.02 of progress, 0.02 for a behaviour: once in fifty episodes), or the corrected test finds the contrary. *Supported*: the corrected
  test finds it. Else *undecided*. A claim of no change is supported where the whole interval is within that difference.
- **The lesser side's progress** is below 0 on average where neither side changes, since it takes the worse of two that vary: to be
  above 0 means all the more, and where it is below, the two sides beside it say more.
- **Early** and **late** are the first and the last sixth of the generations."""
