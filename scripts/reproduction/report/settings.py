"""Every setting beside every other: ablations and sensitivity."""

from __future__ import annotations

import numpy as np

from esp_trainer.analysis.inference import compare, holm
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
    rows, tests = [], []
    for arm in [*found, *(a for a in results.values() if a.arm.name.startswith("scaled-"))]:
        base = results.get(f"paper-3v{arm.arm.config.env.n_prey}")
        if base is not None:
            test = compare(arm.two_sided(until=generations), base.two_sided(until=generations))
            tests.append((arm.arm.name, test))
    for (name, test), p in zip(tests, holm([test.p for _, test in tests]) if tests else [], strict=True):
        rows.append(
            (
                test.difference,
                f"| `{name}` | {test.difference:+.3f} [{test.low:+.3f}, {test.high:+.3f}] | {test.effect:+.2f} | {p_value(float(p))} |",
            )
        )
    ranked = "\n".join(row for _, row in sorted(rows, reverse=True))
    return f"""{table}

Against `paper-3v1` and `paper-3v2` over the same {generations} generations, the lesser side's progress, best first:

| setting | difference [95% interval] | effect | p (Holm) |
| --- | --- | --- | --- |
{ranked}"""
