"""Runs of 10,000 generations: does the race go on, or does it end?"""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import numpy as np
from study import table

from esp_trainer.analysis import plots
from esp_trainer.analysis.inference import MIN_SEEDS
from esp_trainer.types import ROLES
from race import endpoints, exploitability
from race.measure import Arrays
from race.tables import arrows

CONDITION = "long"
PLANNED = 5
WINDOW = 100
"""Generations of the running means that are drawn."""
PARTS = 5
"""Equal parts of a run whose means the table shows."""
KNOWN = (120, 121)
"""Seeds whose results were known when the protocol predicted those of the others."""
WON = 0.05
"""A run is won if the champions catch less of their contemporaries' prey than this, or more than all but this."""
_ALT = "Long runs: what champions catch of their contemporaries, and what exploiters reach, by generation"
_FIGURE = (
    "Left: the fraction of prey that champions catch of their contemporaries. Middle: what exploiting predators catch "
    "of the champion's prey. Right: exploiting prey that escape the champion. Moving averages over 100 generations."
)
_RULES = (
    "By the protocol a run is *won* if in the last tenth of its generations the champions catch less than 5% or more "
    "than 95% of the prey of their contemporaries; else it *goes on* if both sides gain against the panel in its "
    "second half; else it *levels off*, even if one side falls back."
)
_TABLE = (
    "The table has means of fifths of each run; of exploiters, means of its thirds; of fresh evolution, what it "
    "reaches against the champions at the end of each third."
)
_LUCK = "A run in which nothing changes would be said to go on about one time in four."


def tell(arrays: Arrays, figure: str) -> str:
    """Return what became of the runs as Markdown."""
    gains = " and ".join(f"the {role} gain {endpoints.mean_gain(arrays, role, half=True)}" for role in ROLES)
    known = f"In the second half {gains} against the panel. " * (len(arrays["config"]) >= MIN_SEEDS)
    luck = f"{_LUCK} " * ("goes on" in outcomes(arrays))
    heads = ["seed", "the run", "caught of contemporaries", *(f"{role}, panel" for role in ROLES)]
    in_thirds = {"exploiting": _exploiters(arrays), "fresh": [endpoints.fresh(arrays, role) for role in ROLES]}
    heads += [f"{kind} {role}" for kind, found in in_thirds.items() if found for role in ROLES]
    curves = [arrays["caught"].astype(float), *(endpoints.results(arrays, r, "panel").mean(axis=2) for r in ROLES)]
    rows = [
        [seed, end, *(_course(curve[run]) for curve in curves)]
        + [arrows(each[run]) for found in in_thirds.values() for each in found]
        for run, (seed, end) in enumerate(zip(_seeds(arrays), outcomes(arrays), strict=True))
    ]
    told = f"{_RULES} {known}{luck}{_predicted(arrays)}{_TABLE}{exploitability.learned_against(arrays)}"
    return "\n\n".join([told, table(heads, rows), f"![{_ALT}]({figure})", _FIGURE])


def in_short(arrays: Arrays, by_others: float | None = None) -> str:
    """Return how many runs ended in which way. ``by_others`` is what the other runs' predators catch of late prey."""
    n_generations, n_runs = arrays["caught"].shape[1], len(arrays["config"])
    told = ", ".join(f"{end} {n}" for end, n in Counter(outcomes(arrays)).most_common())
    late = np.array_split(arrays["caught"].astype(float), 10, axis=1)[-1].mean()
    fresh = endpoints.fresh(arrays, "predators")[:, -1].mean()
    others = f", and late predators of the other runs catch {by_others:.2f} of them" if by_others is not None else ""
    return (
        f"**Runs of {n_generations:,} generations** (`{CONDITION}`, {n_runs} of the planned {PLANNED} seeds) end as: "
        f"{told}. A run is won by the prey if in its last tenth its own predators catch less than 5% of them; on "
        f"average over these runs they catch {late:.2f}. That is not unbeatable: predators that evolve from nothing "
        f"for 60 generations catch {fresh:.2f} of the last prey{others}. In the end {endpoints.told_level(arrays)}. "
        "The [leaderboard](leaderboard.md#steppe-predators) has the last champions against the zoo's held-out teams."
    )


def _predicted(arrays: Arrays) -> str:
    """Return what became of the protocol's prediction for the runs that were not known when it was made."""
    unseen = [run for run, seed in enumerate(_seeds(arrays)) if seed not in KNOWN]
    falls = [sum(thirds[run, -1] < thirds[run, 0] for run in unseen) for thirds in _exploiters(arrays)]
    if not (unseen and falls):
        return ""
    return (
        f"When seeds 120 and 121 were known, the protocol predicted for the others that exploiters of both sides reach "
        f"less in the last third than in the first: so it was for exploiting predators in {falls[0]} of "
        f"{len(unseen)}, and for exploiting prey in {falls[1]} of {len(unseen)}. "
    )


def _exploiters(arrays: Arrays) -> list[np.ndarray]:
    """Return what exploiters of each side reach in each third, ``(n_runs, 3)`` each; nothing if there are none."""
    if "exploited.prey" not in arrays:
        return []
    return [exploitability.exploiters_by_third(arrays, role) for role in ROLES]


def draw(arrays: Arrays, file: Path) -> None:
    """Draw the fraction of prey that the champions of each run catch of their contemporaries, and what the run's
    exploiters reach against the champions.
    """
    found = {"champions": (np.arange(arrays["caught"].shape[1]), arrays["caught"].astype(float), WINDOW)}
    for role in ROLES if "exploited.prey" in arrays else ():
        x, reached = endpoints.exploiters(arrays, role)
        found[f"exploiting {role}"] = x, reached, max(1, WINDOW // int(x[0] + 1))
    last = min(len(x) for x, _, _ in found.values())
    figure, axes = plots.panels(len(found), width=3.6, columns=3)
    data: dict[str, np.ndarray] = {}
    for panel, (title, (x, runs, window)) in zip(axes, found.items(), strict=True):
        kept = np.linspace(0, len(x) - 1, last).astype(int)
        data |= {f"{title}: generation": x[kept]}
        for number, (seed, values) in enumerate(zip(_seeds(arrays), runs, strict=True)):
            (curve,) = plots.curve(panel, x, values[None], f"seed {seed}", number, window=window).values()
            data |= {f"{title}: seed {seed}": curve[kept]}
        panel.set(title=title, xlabel="generation", ylim=(0, 1))
    axes[0].set(ylabel="caught, or escaped")
    plots.legend_above(axes[0])
    plots.save(figure, file, data)


def _seeds(arrays: Arrays) -> list[int]:
    return [json.loads(str(config))["seed"] for config in arrays["config"]]


def outcomes(arrays: Arrays) -> list[str]:
    """Return the protocol's word for each run: ``won by the prey``, ``won by the predators``, ``goes on`` or ``levels
    off``.
    """
    caught = arrays["caught"].astype(float)
    late = caught[:, -max(1, caught.shape[1] // 10) :].mean(axis=1)
    lesser = np.minimum(*(endpoints.run_gains(arrays, role, half=True) for role in ROLES))
    rules = {"won by the prey": late < WON, "won by the predators": late > 1 - WON, "goes on": lesser > 0}
    return [str(word) for word in np.select(list(rules.values()), list(rules), "levels off")]


def _course(curve: np.ndarray) -> str:
    return arrows(np.array([part.mean() for part in np.array_split(curve, PARTS)]))
