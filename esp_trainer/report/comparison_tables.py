"""Tables of the results of conditions, for the terminal and the page, and the notes that go with them."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import comb

from esp_trainer.analysis.comparison import HELD_OUT, SCRIPTED, Condition, Contrast, contrasts, measure_name
from esp_trainer.analysis.inference import MIN_SEEDS, summary
from esp_trainer.types import ROLES, Role

_IN_WORDS = {
    f"{role}_{panel}_{kind}": f"{words}, {whom}"
    for role in ROLES
    for panel, whom in ((HELD_OUT, "held-out"), (SCRIPTED, "scripts"))
    for kind, words in (("level", "level"), ("progress", "progress"), ("late_progress", "2nd-half progress"))
}
_WIDTH = 120


@dataclass(frozen=True)
class Table:
    """A table of text. The first column holds names, which may be long."""

    heads: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    caption: str = ""


def shown(conditions: Sequence[Condition], role: Role) -> list[str]:
    """Return the names of a side's main measures; none if the side did not evolve in any condition.

    They are level and late progress against held-out opponents, or against scripts if there are no held-out opponents,
    and the level against scripts if there are both.
    """
    known = [panel for panel in (HELD_OUT, SCRIPTED) if _is_known(conditions, measure_name(role, panel, "level"))]
    if not known:
        return []
    first = [measure_name(role, known[0], kind) for kind in ("level", "late_progress")]
    return [*first, *(measure_name(role, panel, "level") for panel in known[1:])]


def _is_known(conditions: Sequence[Condition], measure: str) -> bool:
    return any(len(condition.known(measure)) for condition in conditions)


def compared(conditions: Sequence[Condition], baseline: Condition) -> list[Contrast]:
    """Return the difference of every other condition from the baseline in each measure that is shown."""
    return contrasts(conditions, baseline, [name for role in ROLES for name in shown(conditions, role)])


def answer(found: Sequence[Contrast], baseline: Condition) -> str:
    """Return in a sentence which differences from the baseline are significant; empty if nothing is compared."""
    tested = [each for each in found if each.p is not None]
    clear = [each for each in tested if each.p is not None and each.p < 0.05]
    if not found:
        return ""
    if not tested:
        return f"No verdict: a test takes at least {MIN_SEEDS} seeds of each condition."
    if not clear:
        return f"No difference from {baseline.name} is significant."
    told = "; ".join(f"{each.condition} in {_in_words(each.measure)} ({each.difference:+.2f})" for each in clear)
    return f"Significant differences from {baseline.name}: {told}."


def tables(conditions: Sequence[Condition], baseline: Condition, found: Sequence[Contrast]) -> list[Table]:
    """Return a table of means for each side, and a table of differences from the baseline for each other condition."""
    names = {role: shown(conditions, role) for role in ROLES}
    return [_means(conditions, role, measures) for role, measures in names.items() if measures] + [
        _differences([each for each in found if each.condition == condition.name], condition, baseline)
        for condition in conditions
        if condition is not baseline
    ]


def _in_words(measure: str) -> str:
    return f"{measure.partition('_')[0]}, {_IN_WORDS[measure]}"


def _means(conditions: Sequence[Condition], role: Role, measures: Sequence[str]) -> Table:
    """Return a table with a row for each condition."""
    result = "fraction of prey caught" if role == "predators" else "fraction of prey not caught"
    result = result if conditions[0].runs[0].captures else "payoff"
    rows = [
        (each.name, str(len(each.runs)), *(summary(each.known(measure)) for measure in measures)) for each in conditions
    ]
    heads = (role, "seeds", *(_IN_WORDS[measure] for measure in measures))
    return Table(heads, rows, f"{role}, {result}: mean over seeds [95% interval]")


def _differences(found: Sequence[Contrast], condition: Condition, baseline: Condition) -> Table:
    """Return a table with a row for each measure."""
    rows = []
    for each in found:
        first, compared = _in_words(each.measure), each.comparison
        if compared is None:
            rows.append((first, f"{each.difference:+.3f}", "-", "-"))
        else:
            rows.append((first, compared.interval, f"{compared.effect:+.2f}", f"{each.p:.2g}"))
    heads = ("measure", "difference", "Cliff's delta", "p (Holm)")
    return Table(heads, rows, f"{condition.name} against {baseline.name}")


def on_terminal(table: Table) -> list[str]:
    """Return a table as lines of at most 120 columns. A name too long for its column is printed above its row."""
    columns = [max(len(cell) for cell in column) + 3 for column in zip(*table.rows, table.heads, strict=True)][1:]
    room = _WIDTH - sum(columns)
    width = min(room, max(len(row[0]) for row in [table.heads, *table.rows]))
    lines = textwrap.wrap(table.caption, _WIDTH)
    for name, *cells in [table.heads, *table.rows]:
        above = textwrap.wrap(name, _WIDTH, break_on_hyphens=False) if len(name) > width else []
        rest = "".join(f"{cell:>{column}}" for cell, column in zip(cells, columns, strict=True))
        lines += [*above, f"{'' if above else name:{width}}{rest}".rstrip()]
    return lines


def notes_on(conditions: Sequence[Condition], baseline: Condition) -> list[str]:
    """Return notes on the tables: missing held-out opponents, different lengths, and too few seeds for tests."""
    found = []
    if not any(_is_known(conditions, measure_name(role, HELD_OUT, "level")) for role in ROLES):
        found.append(
            "There are no held-out opponents: the zoo has no team for this world, and no run was given by --panel. "
            "Progress is against scripts."
        )
    lengths = [len(each.runs[0].payoff) for each in conditions]
    if min(lengths) < max(lengths):
        found.append(f"The conditions have {min(lengths)} to {max(lengths)} generations: each is measured to its end.")
    few = [each.name for each in conditions if len(each.runs) < MIN_SEEDS]
    if few:
        found.append(
            f"Of fewer than {MIN_SEEDS} seeds only means are shown, without intervals and tests: {'; '.join(few)}."
        )
    return [*found, *_powerless(conditions, baseline)]


def _powerless(conditions: Sequence[Condition], baseline: Condition) -> Iterable[str]:
    """Yield a note if there are too few seeds for any difference to be significant after the correction."""
    n = len(baseline.runs)
    tested = [len(each.runs) for each in conditions if each is not baseline and min(len(each.runs), n) >= MIN_SEEDS]
    n_measures = sum(len(shown(conditions, role)) for role in ROLES)
    # p is smallest if all seeds of one condition lie above all of the other: 2 of comb(m + n, n) orders do.
    least = min((2 / comb(m + n, n) for m in tested), default=0.0) * len(tested) * n_measures
    if least > 0.05:
        yield (
            f"With so few seeds no p can be below 0.05: corrected over {len(tested) * n_measures} differences, the "
            f"least possible is {min(1, least):.2g}."
        )
