"""``docs/race.md``: what the measurements say, as Markdown. Every number in it is made here."""

from __future__ import annotations

from pathlib import Path

from esp_trainer.analysis.inference import compare
from esp_trainer.files import write_text
from esp_trainer.types import ROLES
from race import answer, courses, endpoints, exploitability, late, long, tables
from race.figures import draw
from race.measure import Arrays, Task, load
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
    by_others = late.caught_by_others(late.file(kept, "steppe"), long.CONDITION)
    parts = [HEAD.format(runs=runs, answer=answer.in_short(tasks, by_others))]
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
    found = {file.stem: load(file) for file in place.glob("*.npz")}
    order = {name: i for i, name in enumerate(FIRST)}
    return dict(sorted(found.items(), key=lambda item: (order.get(item[0], len(order)), item[0])))


def _without_long(found: Task) -> Task:
    """Return the conditions that are as long as the protocol's."""
    return {name: arrays for name, arrays in found.items() if name != long.CONDITION}


def _of_task(task: str, every: Task, against_late: str | None) -> str:
    """Return the part of the page about a task: its questions, each with its answer, tables and figures."""
    found = _without_long(every)
    level = f"![What both sides reach against the panel by generation, in each condition](race/level-{task}.png)"
    shown = [] if task == "steppe" and "race" in found else [level]  # that one stands at the head of the page
    going = [_going_on(found["race"], found.get("paper"))] if "race" in found else []
    going += [_growing(found["growing-steps"], 4 if task == "3v1" else 0)] if "growing-steps" in found else []
    parts = {"Does it go on?": [*going, *shown, _GAINS, tables.by_condition(found, tables.GAINS)]}
    parts["Does it go on?"] += [_LESSER, tables.lesser_gains(found), *([against_late] if against_late else [])]
    if {"race", "race-monolithic"} <= found.keys():
        parts["Does splitting sustain it?"] = [
            _splitting(found, *(("a prey", 4) if task == "3v1" else ("an agent", 3)))
        ]
    if long.CONDITION in every:
        parts["Long runs"] = [long.tell(every[long.CONDITION], f"race/long-{task}.png")]
    parts["How hard champions are to beat"] = exploitability.tell(task, found)
    parts["Levels"] = [_LEVELS, tables.by_condition(found, tables.LEVELS)]
    if "race" in found and len(found) > 1:
        differences = f"![How far each condition ends from `race`](race/differences-{task}.png)"
        parts["Levels"] += [differences, _CONTRASTS, tables.contrasts(found)]
    columns = {name: tables.behaviour(name) for name in TRACKED[task]}
    parts["Behaviours"] = [_BEHAVIOURS, tables.by_condition(found, columns)]
    if courses.known(found.get("race", {})):
        parts["Behaviours"].append(courses.tell(found["race"], f"race/behaviours-{task}.png"))
    told = ["\n\n".join([f"### {head}", *part]) for head, part in parts.items()]
    return "\n\n".join([f"## {TASK_TITLES[task]}", *told])


def _going_on(arrays: Arrays, paper: Arrays | None) -> str:
    """Return what became of the first hypothesis."""
    whole, late = ([endpoints.mean_gain(arrays, role, half=half) for role in ROLES] for half in (False, True))
    passed = all(each.low > 0 for each in late)
    told = (
        "**Hypothesis 1**: the race stops because of the choice of opponents and the noise of selection, and in a "
        f"better setting both sides keep improving. By its test, that both gain in the second half, it "
        f"**{'holds' if passed else 'does not hold'}** for these {len(arrays['config'])} seeds. The predators gain "
        f"{whole[0]} over the whole run and {late[0]} in its second half, the prey {whole[1]} and {late[1]}."
    )
    if passed and paper:
        same = [compare(*(endpoints.run_gains(each, role, half=True) for each in (arrays, paper))) for role in ROLES]
        told += (
            f" That the setting is the cause is another question: the second-half gains less those of the paper's "
            f"setting on these cells are {same[0].interval} and {same[1].interval} ({len(paper['config'])} seeds)."
        )
    return told + _few(len(arrays["config"]))


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
        f"**Hypothesis 2**: in this setting splitting, a network for each opponent that {who} sees, sustains the race. "
        f"Second-half gain of `race` less that of `race-monolithic` ({len(whole['config'])} seeds of the planned 20), "
        f"with one network for all opponents and about half as many weights: {', '.join(gains)}. Level at the end: "
        f"{', '.join(levels)}. By the protocol's test it so far {' and '.join(verdicts)}; the protocol does not say "
        f"whether one side is enough. This is open until all seeds are run; it was first looked at with {looked_at}."
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
_GAINS = "Gains against the panel: the last sixth of the generations less the first."
_LEVELS = "Levels at the end of the run, mean over seeds [95% interval]."
_LESSER = (
    "The smaller of the two sides' gains in each run, mean over seeds; its p against the same runs read backwards "
    "(one-sided, Holm over this table), which says only that something changes; and in how many runs both sides gain."
)
_BEHAVIOURS = "Behaviours, rate beyond chance, mean over the generations."
