"""Tables of all settings: each with its progress, and each against the paper's setting of the same world."""

from __future__ import annotations

from collections.abc import Sequence

from study import table

from esp_trainer.analysis.inference import Comparison, compare, holm
from esp_trainer.types import ROLES
from reproduction.cells import All, mean, p_value, rows_of, strengths
from reproduction.results import StudyResults

_DIFFERENCES = ["setting", "difference [95% interval]", "effect", "p (Holm)"]


def progress_and_level(results: All, parts: tuple[str, ...], until: int | None = None) -> str | None:
    """Return progress and level of some settings against held-out opponents."""

    def row(found: StudyResults) -> list[str]:
        cells = [found.setting.meaning, str(found.n_seeds), mean(found.late("caught"))]
        if "panel.predators" not in found or "panel.prey" not in found:
            return [*cells, *"------"]
        reached = found.late_share("panel.predators", until), 1 - found.late_share("panel.prey", until)
        cells += [*strengths(found.global_progress(until=until), 2), mean(found.two_sided(until=until))]
        return [*cells, *map(mean, reached), mean(found.cyclic_share())]

    names = [name for name, found in results.items() if found.setting.part in parts]
    heads = ["setting", "what it is", "seeds", "caught", "predators' progress", "prey's progress", "lesser of both"]
    heads += ["predators' level", "prey's level", "depends on the opponent"]
    return table(heads, rows_of(results, names, row)) if names else None


def ranked(results: All, parts: tuple[str, ...], until: int | None = None) -> str | None:
    """Return the lesser side's progress of each setting against the paper's in the same world, best first."""
    shown = [found for part in parts for found in results.values() if found.setting.part == part]
    pairs = [(found, base) for found in shown if (base := _base(found, results)) is not None]
    if not pairs:
        return None
    tests = [compare(found.two_sided(until=until), base.two_sided(until=until)) for found, base in pairs]
    rows = _differences([f"`{found.setting.name}`" for found, _ in pairs], tests)
    order = sorted(range(len(tests)), key=lambda i: (tests[i].difference, rows[i]), reverse=True)
    return table(_DIFFERENCES, [rows[i] for i in order])


def levels(results: All) -> str | None:
    """Return how late champions of both sides stand against held-out opponents, beside the paper's setting."""
    names, tests = [], []
    for found in results.values():
        base = _base(found, results)
        if found.setting.part == "modern" and base is not None:
            for role, sign in zip(ROLES, (1, -1), strict=True):
                late = (sign * each.late_share(f"panel.{role}") for each in (found, base))
                tests.append(compare(*late))
                names.append(f"`{found.setting.name}`, level of the {role}")
    return table(_DIFFERENCES, _differences(names, tests)) if tests else None


def _differences(names: Sequence[str], tests: Sequence[Comparison]) -> list[list[str]]:
    corrected = holm([test.p for test in tests])
    return [
        [name, test.interval, f"{test.effect:+.2f}", p_value(float(p))]
        for name, test, p in zip(names, tests, corrected, strict=True)
    ]


def _base(found: StudyResults, results: All) -> StudyResults | None:
    """Return the paper's setting of the same world, if the two can be compared."""
    base = results.get(f"paper-3v{found.setting.config.env.n_prey}")
    return base if base is not None and found.setting.world == base.setting.world and "panel.prey" in found else None
