"""What the level is made of, and how much of the cycling is the game's own."""

from __future__ import annotations

import numpy as np

from esp_trainer.analysis.progress import historical_progress
from reproduction.arms import PARITY_ARMS
from reproduction.report.words import mean, present
from reproduction.results import Results


def parity(results: dict[str, Results]) -> str:
    """Captures by the parity of the start, when predators overcome it, and what goes on beneath."""
    arms = present(results, *PARITY_ARMS)
    if not arms:
        return ""
    rows = []
    for arm in arms:
        late = results[arm]["curve.caught_by_even"].astype(float)
        late = late[:, -(late.shape[1] // 3) :].mean(axis=1)
        cells = " | ".join(mean(np.nan_to_num(late[:, even])) for even in range(late.shape[1]))
        rows.append(f"| `{arm}` | {cells} | {_discovered(results[arm])} |")
    return """## Parity: what the level is made of

On an even torus a predator that starts at an odd distance from a prey that always moves can only land on it if it idles once.

![Captures by parity of the start](reproduction/parity.png)

Share of prey caught in the last third of the run, champion against champion, by how many of the three predators start at an
even distance; and in how many seeds the predators ever learn to do without (of the prey with no predator at an even distance,
at least half caught over ten generations), with the generations at which they first do:

| setting | 0 even | 1 even | 2 even | 3 even | parity overcome |
| --- | --- | --- | --- | --- | --- |
""" + "\n".join([*rows, "", _beneath(results)])


def _beneath(results: dict[str, Results]) -> str:
    """Progress in the second half of the run, within each parity."""
    rows = []
    for arm in present(results, "paper-3v1", "scaled-3v1"):
        found = results[arm]
        late = found.generations >= found.halfway
        for even in range(found["own.captured"].shape[-1]):
            shares = found["own.captured"][..., even] / np.maximum(found["met"][:, even], 1)[:, None, None]
            both = [historical_progress(caught[late][:, late]) for caught in shares]
            sides = [np.array([getattr(each, side).strength for each in both]) for side in ("predators", "prey")]
            rows.append(f"| `{arm}` | {even} | {' | '.join(mean(values, 3) for values in sides)} |")
    return """Whether the race goes on beneath the level: progress of both sides against each other within the second half of the run, by
the parity of the start:

| setting | predators at an even distance | predators' progress | prey's progress |
| --- | --- | --- | --- |
""" + "\n".join(rows)


def _discovered(found: Results) -> str:
    """When predators first catch at least half of the prey that none of them starts at an even distance from."""
    curves = np.nan_to_num(found["curve.caught_by_even"][:, :, 0].astype(float))
    window = min(10, curves.shape[1])
    means = np.apply_along_axis(lambda row: np.convolve(row, np.ones(window) / window, "valid"), 1, curves)
    first = [int(np.argmax(row >= 0.5)) for row in means if (row >= 0.5).any()]
    when = f" (generations {', '.join(map(str, sorted(first)))})" if first else ""
    return f"{len(first)} of {len(curves)} seeds{when}"


def cycles(results: dict[str, Results]) -> str:
    """How much of the cycling is the game's own."""
    rows = []
    for arm in present(
        results,
        "paper-3v1",
        "odd-torus-3v1",
        "prey-first-3v1",
        "no-idling-3v1",
        "scaled-3v1",
        "modern-3v1",
        "linear-3v1",
        "drawn-3v1",
        "paper-3v2",
        "prey-first-3v2",
        "linear-3v2",
        "drawn-3v2",
    ):
        found = results[arm]
        count = np.array([float(each.count) for each in found.alternations])
        cycles = f"{sum(found.cycling())} of {found.n_seeds}"
        rows.append(f"| `{arm}` | {mean(count, 1)} | {cycles} | {mean(found.cyclic_share())} |")
    if not rows:
        return ""
    return """## Cycles, and whose they are

Three predators that move at once with the prey close at most three of its four exits, so no pure strategy is safe and cycles
belong to the game; where the prey move first and are seen, three pursuers suffice (Neufeld & Nowakowski 1998). Alternations of
success, the seeds in which they make cycles (two or more, and more than by chance), and the share of who beats whom
that depends on the opponent (beyond noise). Teams that draw their actions (`drawn`) cannot be foreseen, and where they
do less depends on the opponent; they are to be compared with `linear`, as their outputs are linear too:

| setting | alternations a run | seeds with cycles | depends on the opponent |
| --- | --- | --- | --- |
""" + "\n".join(rows)
