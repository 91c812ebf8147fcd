"""``docs/race.md``: what the measurements say, as Markdown. Every number in it is made here."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from esp_trainer.analysis.inference import compare, summary
from esp_trainer.files import write_text
from esp_trainer.types import ROLES, Role
from race import answer, courses, endpoints, exploitability, late, long, tables
from race.figures import draw
from race.measure import Arrays, Task
from race.text import HEAD, METHOD, TASK_TITLES

_TWO_PREY = (
    *("role switch", "blocker", "opposing attack", "encirclement"),
    *("herding", "simultaneous capture", "scattering"),
)
TRACKED = {
    "steppe": _TWO_PREY,
    "3v1": ("role switch", "blocker", "opposing attack", "encirclement", "baiting", "sidestepping"),
    "3v2": _TWO_PREY,
}
"""Behaviours that are told of, by task; the page has the tasks in this order."""
FIRST = ("race", "race-monolithic", "paper", "bias-pool")
"""Conditions that figures show, in this order; tables show all, these first."""


def write(kept: Path, out: Path) -> None:
    """Write the page and its figures from what is kept."""
    tasks = {task: _load(kept / task) for task in TRACKED if (kept / task).is_dir()}
    tasks = {task: found for task, found in tasks.items() if found}
    if not tasks:
        raise SystemExit(f"there is nothing to report on in {kept}")
    runs = sum(len(a["config"]) for found in tasks.values() for a in found.values())
    parts = [HEAD.format(runs=runs, answer=answer.in_short(tasks))]
    for task, found in tasks.items():
        draw(task, _without_long(found), FIRST, kept.parent)
        if long.CONDITION in found:
            long.draw(found[long.CONDITION], kept.parent / f"long-{task}.png")
        if courses.known(found.get("race", {})):
            courses.draw(found["race"], kept.parent / f"behaviours-{task}.png")
        parts += [_of_task(task, found, late.tell(late.file(kept, task)))]
    parts.append(METHOD)
    write_text(out / "race.md", "\n\n".join(parts) + "\n")
    print(f"{out / 'race.md'}: {', '.join(f'{task} {len(found)} conditions' for task, found in tasks.items())}")


def _load(place: Path) -> Task:
    found = {}
    for file in place.glob("*.npz"):
        with np.load(file) as arrays:
            found[file.stem] = dict(arrays)
    order = {name: i for i, name in enumerate(FIRST)}
    return dict(sorted(found.items(), key=lambda item: (order.get(item[0], len(order)), item[0])))


def _without_long(found: Task) -> Task:
    """Return the conditions that are as long as the protocol's."""
    return {name: arrays for name, arrays in found.items() if name != long.CONDITION}


def _of_task(task: str, every: Task, against_late: str | None) -> str:
    found = _without_long(every)
    parts = [f"## {TASK_TITLES[task]}"]
    if "race" in found:
        parts.append(_answer(found["race"]))
    if {"race", "race-monolithic"} <= found.keys():
        parts.append(_splitting(found, *(("a prey", 4) if task == "3v1" else ("an agent", 3))))
    if "growing-steps" in found:
        parts.append(_growing(found["growing-steps"], n_looked=4 if task == "3v1" else 0))
    if long.CONDITION in every:
        parts.append(long.tell(every[long.CONDITION], f"race/long-{task}.png"))
    parts += [
        f"![What both sides reach against the panel by generation, in each condition](race/level-{task}.png)",
        "Levels at the end of the run, mean over seeds [95% interval].",
        tables.by_condition(found, tables.LEVELS),
        "Gains against the panel: the last sixth of the generations less the first.",
        tables.by_condition(found, tables.GAINS),
    ]
    if against_late:
        parts.append(against_late)
    if "race" in found and len(found) > 1:
        parts += [
            f"![How far each condition ends from `race`](race/differences-{task}.png)",
            _CONTRASTS,
            tables.contrasts(found),
        ]
    parts += [_LESSER, tables.lesser_gains(found)]
    parts += [
        *exploitability.tell(task, found),
        "Behaviours, rate beyond chance, mean over the generations.",
        tables.by_condition(found, {name: tables.behaviour(name) for name in TRACKED[task]}),
    ]
    if courses.known(found.get("race", {})):
        parts.append(courses.tell(found["race"], f"race/behaviours-{task}.png"))
    return "\n\n".join(parts)


def _answer(arrays: Arrays) -> str:
    """Return what the recommended preset comes to, in a few sentences."""

    def gain(role: Role, *, half: bool) -> str:
        return str(endpoints.mean_gain(arrays, role, half=half))

    sides = [
        f"**The {role} gain {gain(role, half=False)}** against the panel over the whole run, and "
        f"{gain(role, half=True)} in its second half."
        for role in reversed(ROLES)
    ]
    late = [endpoints.mean_gain(arrays, role, half=True) for role in ROLES]
    verdict = "holds" if all(each.low > 0 for each in late) else "does not hold"
    escape, catch = (summary(endpoints.level(arrays, role, "panel")) for role in reversed(ROLES))
    return (
        f"`race`, {len(arrays['config'])} seeds. {' '.join(sides)} In the end {escape} of the prey escape the panel's "
        f"predators, and the predators catch {catch} of the panel's prey.\n\nBy the protocol the first hypothesis, "
        f"that both sides still improve in the second half, **{verdict}** for these seeds.{_few(len(arrays['config']))}"
    )


def _few(n_seeds: int) -> str:
    """Return a warning where a condition has so few seeds that its intervals are too narrow."""
    told = (
        " Intervals from so few runs are too narrow: take this as a first look, until the protocol's 20 seeds are "
        "there."
    )
    return told * (n_seeds < endpoints.ENOUGH)


def _splitting(found: Task, who: str, looked_at: int) -> str:
    """Return what splitting networks comes to, within the recommended preset.

    Args:
        found: The measurements of the task.
        who: Whose networks are split.
        looked_at: Number of runs with one network whose results were known before the others were done.
    """
    split, whole = found["race"], found["race-monolithic"]
    gain = {r: compare(*(endpoints.run_gains(a, r, half=True) for a in (split, whole))) for r in ROLES}
    level = {r: compare(*(endpoints.level(a, r, "panel") for a in (split, whole))) for r in ROLES}
    gains = (f"{role} {each.interval} (p {each.p:.2g} without correction)" for role, each in gain.items())
    levels = (f"{role} {each.interval}" for role, each in level.items())
    verdicts = (f"**{'holds' if each.low > 0 else 'fails'}** for the {role}" for role, each in gain.items())
    return (
        f"**A network for each opponent that {who} sees, against one that sees all**, with about half as many weights "
        f"(`race-monolithic`, {len(whole['config'])} seeds of the planned 20). Second-half gain, split less unsplit: "
        f"{', '.join(gains)}. Level at the end: {', '.join(levels)}. By the protocol the second hypothesis, that "
        f"splitting sustains the race, so far {' and '.join(verdicts)}. This is open until all seeds are run; it was "
        f"first looked at with {looked_at}."
    )


def _growing(arrays: Arrays, n_looked: int) -> str:
    """Return what mutations in proportion to the genes come to in the second half of a run; the first ``n_looked`` runs
    are no test.
    """
    found = [endpoints.mean_gain(arrays, role, half=True, seeds=slice(n_looked, None)) for role in ROLES]
    verdict = "both sides still improve" if min(each.low for each in found) > 0 else "it is not shown that both improve"
    n = len(arrays["config"]) - n_looked
    seeds = f"{n} seeds" + f", besides {n_looked} of a first look" * bool(n_looked)
    return (
        f"**Mutations that grow with the genes** (`growing-steps`, {seeds}, else the same): in the second half the "
        f"predators gain {found[0]} and the prey {found[1]}, so that **{verdict}**.{_few(n)}"
    )


_CONTRASTS = (
    "Each other condition less `race`, against the panel: Hodges-Lehmann differences between seeds [95% interval, not "
    "corrected], and p of the rank test (Holm over this table)."
)
_LESSER = (
    "The smaller of the two sides' gains, mean over seeds, with its p against runs read backwards (Holm over this "
    "table). A small p says that something changes; it is also found where one side only holds its level."
)
