"""Every setting beside every other: ablations, sensitivity, and the strongest."""

from __future__ import annotations

import numpy as np

from esp_trainer.analysis.inference import Comparison, compare, holm
from reproduction.arms import world_of
from reproduction.report.words import mean, p_value
from reproduction.results import Results


def settings(
    results: dict[str, Results], title: str, parts: tuple[str, ...], figure: str, until: int | None = None
) -> str:
    """A table of some settings, with progress and level against held-out opponents."""
    shown = [found for found in results.values() if found.arm.part in parts]
    rows = [
        f"| `{found.arm.name}` | {found.arm.meaning} | {found.n_seeds} | {mean(found.late('caught'))} | {_sides(found, until)} |"
        for found in shown
    ]
    return f"""## {title}

![Progress against held-out opponents](reproduction/{figure}.png)

*Caught*: share of prey, champion against champion, last third of the run. *Progress*: late minus early generations against
held-out opponents of the same world, in shares of prey. *Level*: where the last sixth stands against them. *Depends on the
opponent*: share of who beats whom that no ladder explains (Hodge decomposition).

| setting | what it is | seeds | caught | predators' progress | prey's progress | lesser of both | predators' level | prey's level | depends on the opponent |
| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |
""" + "\n".join(rows)


def _sides(found: Results, until: int | None) -> str:
    if "panel.predators" not in found or "panel.prey" not in found:
        return "- | - | - | - | - | -"
    both = found.global_progress(until=until)
    cells = [
        mean(np.array([side.predators.strength for side in both])),
        mean(np.array([side.prey.strength for side in both])),
        mean(found.two_sided(until=until)),
        mean(found.late_share("panel.predators", until)),
        mean(1 - found.late_share("panel.prey", until)),
        mean(found.cyclic_share()),
    ]
    return " | ".join(cells)


def sensitivity(results: dict[str, Results]) -> str:
    """One factor at a time, and how each differs from the paper's setting."""
    found = [arm for arm in results.values() if arm.arm.part == "sensitivity"]
    if not found:
        return ""
    generations = found[0]["curve.caught"].shape[1]
    table = settings(results, "Sensitivity: one factor at a time", ("sensitivity",), "sensitivity", generations)
    one_factor = [arm for arm in results.values() if arm.arm.part == "ablation" and _same_world(arm, results)]
    return f"""{table}

Against `paper-3v1` and `paper-3v2` over the same {generations} generations, the lesser side's progress, best first, with the
ablations that play in the same world:

{_ranked([*found, *one_factor], results, generations)}"""


def strongest(results: dict[str, Results]) -> str:
    """What did best alone, together; and the setting that ships as ``modern``, from seeds of its own."""
    found = [arm for arm in results.values() if arm.arm.part in ("combination", "modern")]
    if not found:
        return ""
    table = settings(results, "The strongest race: `modern`", ("combination", "modern"), "modern")
    combined = [arm for arm in found if arm.arm.part == "combination"]
    confirmed = [arm for arm in found if arm.arm.part == "modern"]
    parts = [table, _TOGETHER, _ranked(combined, results)]
    if confirmed:
        parts += [_CONFIRMED, _ranked(confirmed, results), _levels(confirmed, results)]
    return "\n\n".join(parts)


def _same_world(arm: Results, results: dict[str, Results]) -> bool:
    base = _base(arm, results)
    return base is not None and world_of(arm.arm.config) == world_of(base.arm.config) and "panel.prey" in arm


def _base(arm: Results, results: dict[str, Results]) -> Results | None:
    return results.get(f"paper-3v{arm.arm.config.env.n_prey}")


def _ranked(arms: list[Results], results: dict[str, Results], until: int | None = None) -> str:
    """The lesser side's progress of each against the paper's setting, best first."""
    pairs = [(arm, base) for arm in arms if (base := _base(arm, results)) is not None]
    tests = [compare(arm.two_sided(until=until), base.two_sided(until=until)) for arm, base in pairs]
    corrected = holm([test.p for test in tests]) if tests else []
    rows = [
        (test.difference, f"| `{arm.arm.name}` | {_difference(test, float(p))} |")
        for (arm, _), test, p in zip(pairs, tests, corrected, strict=True)
    ]
    return _DIFFERENCES + "\n".join(row for _, row in sorted(rows, reverse=True))


def _levels(arms: list[Results], results: dict[str, Results]) -> str:
    """How late champions of both sides stand against held-out opponents, against the paper's setting."""
    rows, tests = [], []
    for arm in arms:
        base = _base(arm, results)
        if base is not None:
            for side, sign in (("predators", 1), ("prey", -1)):
                name = f"panel.{side}"
                tests.append(compare(sign * arm.late_share(name), sign * base.late_share(name)))
                rows.append(f"`{arm.arm.name}`, level of the {side}")
    corrected = holm([test.p for test in tests]) if tests else []
    return _DIFFERENCES + "\n".join(
        f"| {row} | {_difference(test, float(p))} |" for row, test, p in zip(rows, tests, corrected, strict=True)
    )


_TOGETHER = """What did best alone was tried together. Against `paper-3v1` and `paper-3v2`, the lesser side's progress, best
first:"""
_CONFIRMED = """The setting was chosen by these runs, so they flatter it; it was then run from 20 other seeds. The lesser side's
progress of those, and the levels of both sides, against `paper-3v1` and `paper-3v2`:"""
_DIFFERENCES = """| setting | difference [95% interval] | effect | p (Holm) |
| --- | --- | --- | --- |
"""


def _difference(test: Comparison, p: float) -> str:
    interval = f"{test.difference:+.3f} [{test.low:+.3f}, {test.high:+.3f}]"
    return f"{interval} | {test.effect:+.2f} | {p_value(p)}"
