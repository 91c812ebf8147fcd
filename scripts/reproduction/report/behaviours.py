"""The table of behaviours."""

from __future__ import annotations

import numpy as np

from reproduction.report.words import mean
from reproduction.results import Results


def behaviours(results: dict[str, Results]) -> str:
    """Every behaviour in both tasks, with moments of them."""
    arms = [arm for arm in ("paper-3v1", "paper-3v2") if arm in results]
    if not arms:
        return ""
    names = [key.removeprefix("behaviour.") for key in results[arms[-1]].arrays if key.startswith("behaviour.")]
    rows = []
    for name in names:
        cells = []
        for arm in arms:
            rates = results[arm].behaviour(name)
            if np.isnan(rates).all():
                cells.append("- | -")
            else:
                peaks = np.nanmax(rates, axis=1)
                cells.append(f"{mean(np.nanmean(rates, axis=1))} | {np.median(peaks):.2f}, {peaks.max():.2f}")
        rows.append(f"| {name} | {' | '.join(cells)} |")
    heads = " | ".join(f"`{arm}`, mean | peak: median seed, best seed" for arm in arms)
    return f"""## Behaviours

![Behaviours by generation](reproduction/behaviours.png)

![A moment of each behaviour](reproduction/moments.png)

For each behaviour the moment that its detector picked, from the run and generation in which it was seen most, in the manner of
the paper's figures 4 and 6: predators orange with triangles, prey blue with squares, circles where the excerpt begins.

Share of episodes in which a behaviour is seen, minus the share in which it is when predators and prey of different episodes are
paired (idling and parity idle: plain shares; specialisation: how much of a role is known from which predator it is). Definitions are the docstrings of
`esp_trainer.analysis.behaviours`; the peak is the highest of {len(results[arms[0]]["watched"][0])} watched generations.

| behaviour | {heads} |
| --- | {" | ".join(["---"] * (2 * len(arms)))} |
""" + "\n".join(rows)
