"""``docs/race.md``: what the measurements say, as Markdown. Every number in it is made here."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from esp_trainer.analysis.inference import compare, summary
from esp_trainer.files import write_text
from esp_trainer.types import ROLES, Role
from race import endpoints, late, long, tables
from race.figures import draw
from race.measure import Arrays
from race.text import HEAD, METHOD, TASK_TITLES

Task = dict[str, Arrays]
"""The measurements of each condition."""

_TWO_PREY = ("role switch", "blocker", "opposing attack", "herding", "simultaneous capture", "scattering")
TRACKED = {
    "3v1": ("role switch", "blocker", "opposing attack", "encirclement", "baiting", "sidestepping"),
    "3v2": _TWO_PREY,
    "steppe": _TWO_PREY,
}
ENOUGH = 10
"""Runs from which an interval drawn from runs is taken at its word."""
LOOKED_AT = (100, 101, 102, 103, 104, 109, 110)
"""Seeds of `steppe` whose results were known before the last of the twenty ran."""
FIRST = ("race", "race-monolithic", "paper", "bias-pool")
"""Conditions that figures show, in this order; tables show all, these first."""


def write(kept: Path, out: Path) -> None:
    """Write the page and its figures from what is kept."""
    tasks = {task: _load(kept / task) for task in TRACKED if (kept / task).is_dir()}
    tasks = {task: found for task, found in tasks.items() if found}
    if not tasks:
        raise SystemExit(f"there is nothing to report on in {kept}")
    runs = sum(len(a["config"]) for found in tasks.values() for a in found.values())
    parts = [HEAD.format(runs=runs, answer=_in_short(tasks))]
    for task, found in tasks.items():
        draw(task, _without_long(found), FIRST, kept.parent)
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


def _in_short(tasks: dict[str, Task]) -> str:
    """Return the answer of the page: what became of one prey, and of two on `steppe`, in the recommended setting."""
    one_prey = _one_prey(tasks.get("3v1", {}))
    steppe = tasks.get("steppe", {})
    if "race" not in steppe:
        return one_prey
    whole = [_unsplit(steppe["race-monolithic"])] if "race-monolithic" in steppe else []
    return "\n\n".join([_two_prey(steppe["race"]), *whole, one_prey])


def _unsplit(arrays: Arrays) -> str:
    """Return what became of two prey on `steppe` where each agent has one network."""
    predators, prey = (f"{endpoints.level(arrays, role, 'panel').mean():.2f}" for role in ROLES)
    return (
        f"If each agent has one network that sees all opponents, in place of one for each, the predators "
        f"{_course(arrays, 'predators')},\nand the prey {_course(arrays, 'prey')} (`race-monolithic`, "
        f"{len(arrays['config'])} seeds). In the end {prey} of the prey escape, and the predators catch {predators}."
    )


def _two_prey(race: Arrays) -> str:
    """Return what became of three predators and two prey on `steppe` in the recommended setting."""
    n = len(race["config"])

    def gain(role: Role, seeds: slice | list[int] = slice(None)) -> endpoints.Interval:
        return endpoints.over_runs_and_panel(endpoints.gains(race, role, half=True)[seeds])

    predators, prey = gain("predators"), gain("prey")
    if n < ENOUGH or min(predators.low, prey.low) <= 0:
        courses = "; ".join(f"the {role} {_course(race, role)}" for role in ROLES)
        return f"**With two prey on 40 x 40 cells** (`steppe`) {courses} ({n} seeds)."
    unseen = [i for i, config in enumerate(race["config"]) if json.loads(str(config))["seed"] not in LOOKED_AT]
    return (
        f"**Yes, with two prey on 40 x 40 cells** (`race-steppe`, {n} seeds): in the second half of 1,500 generations "
        f"both sides still improve against opponents\nthat nobody trained on, the predators by {predators} "
        f"and the prey by {prey}. The number of seeds was fixed before\nthe first run, and "
        f"{n - len(unseen)} of them were looked at on the way; in the other {len(unseen)} alone the predators gain "
        f"{gain('predators', unseen)} and the prey {gain('prey', unseen)}."
    )


def _one_prey(found: Task) -> str:
    """Return what became of three predators and one prey in the recommended setting."""
    if not {"race", "paper"} <= found.keys():
        return "Nothing is measured yet that the recommended setting can be compared with."
    race, paper = found["race"], found["paper"]

    def reached(arrays: Arrays, role: Role) -> str:
        return f"{endpoints.level(arrays, role, 'panel').mean():.2f}"

    whole = found.get("race-monolithic")
    single = f" Of prey with one network that sees all predators, {reached(whole, 'prey')} escape." if whole else ""
    return (
        f"With one prey on the paper's torus (`race-3v1`) the prey {_course(race, 'prey')}; the predators "
        f"{_course(race, 'predators')} "
        f"({len(race['config'])} seeds). In the end {reached(race, 'prey')} of the prey escape from predators that\n"
        f"nobody trained on, and the predators catch {reached(race, 'predators')} of such prey. In the paper's setting "
        f"{reached(paper, 'prey')} of the prey escape, and the predators catch {reached(paper, 'predators')}.{single}"
    )


def _course(arrays: Arrays, role: Role) -> str:
    """Return in words what a side gained against the panel in the whole run, and in its second half."""
    whole, late = (endpoints.over_runs_and_panel(endpoints.gains(arrays, role, half=half)) for half in (False, True))
    if late.low > 0:
        return "improve for the whole run" if whole.low > 0 else "improve in its second half only"
    if late.high < 0:
        return "improve and then fall back in the second half" if whole.low > 0 else "fall back in the second half"
    if whole.low > 0:
        return "improve, but not measurably in the second half"
    return "do not measurably improve in the second half"


def _without_long(found: Task) -> Task:
    """Return the conditions that are as long as the protocol's."""
    return {name: arrays for name, arrays in found.items() if name != long.CONDITION}


def _of_task(task: str, every: Task, against_late: str | None) -> str:
    found = _without_long(every)
    parts = [f"## {TASK_TITLES[task]}"]
    if "race" in found:
        parts.append(_answer(found["race"]))
    if {"race", "race-monolithic"} <= found.keys():
        parts.append(_splitting(found, "a prey" if task == "3v1" else "an agent"))
    if "growing-steps" in found:
        parts.append(_growing(found["growing-steps"]))
    if long.CONDITION in every:
        parts.append(long.tell(every[long.CONDITION]))
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
    if any("exploited.prey" in arrays for arrays in found.values()):
        figure = f"![What exploiters reach against the champion, by generation](race/exploiters-{task}.png)"
        parts += [figure, _EXPLOITERS]
    parts += [
        f"![What fresh teams reach against frozen champions, by their generation](race/exploited-{task}.png)",
        "What fresh evolution reaches against the champions of the first, the middle and the last third.",
        tables.by_condition(found, tables.EXPLOITED),
        "Behaviours, rate beyond chance, mean over the generations.",
        tables.by_condition(found, {name: tables.behaviour(name) for name in TRACKED[task]}),
    ]
    return "\n\n".join(parts)


def _answer(arrays: Arrays) -> str:
    """Return what the recommended preset comes to, in a few sentences."""

    def gain(role: Role, *, half: bool) -> str:
        return str(endpoints.over_runs_and_panel(endpoints.gains(arrays, role, half=half)))

    sides = [
        f"**The {role} gain {gain(role, half=False)}** against the panel over the whole run, and "
        f"{gain(role, half=True)} in its second half."
        for role in reversed(ROLES)
    ]
    late = [endpoints.over_runs_and_panel(endpoints.gains(arrays, role, half=True)) for role in ROLES]
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
    return told * (n_seeds < ENOUGH)


def _splitting(found: Task, who: str) -> str:
    """Return what splitting networks comes to, within the recommended preset; ``who`` says whose networks are split."""
    split, whole = found["race"], found["race-monolithic"]

    def larger(role: Role) -> tuple[str, str]:
        late = compare(*(endpoints.gains(each, role, half=True).mean(axis=1) for each in (split, whole)))
        reached = compare(*(endpoints.level(each, role, "panel") for each in (split, whole)))
        verdict = "holds" if late.low > 0 else "is not decided" if late.high > 0 else "does not hold"
        told = f"by {tables.difference(late)} (p {late.p:.2g} without correction), and their level at the end by "
        return told + tables.difference(reached), verdict

    (prey, holds), (predators, holds_too) = larger("prey"), larger("predators")
    return (
        f"**A network for each opponent that {who} sees, against one that sees all** (`race-monolithic`, "
        f"{len(whole['config'])} seeds, else the same): the prey's second-half gain is larger {prey}; the predators' "
        f"{predators}. By the protocol the second hypothesis, that splitting sustains the race, **{holds}** for the "
        f"prey and **{holds_too}** for the predators.{_few(len(whole['config']))}"
    )


def _growing(arrays: Arrays) -> str:
    """Return what mutations in proportion to the genes come to in the second half of a run."""

    def gain(role: Role, seeds: slice = slice(None)) -> endpoints.Interval:
        return endpoints.over_runs_and_panel(endpoints.gains(arrays, role, half=True)[seeds])

    n_seeds, n_looked = len(arrays["config"]), 4
    told = (
        f"**Mutations that grow with the genes** (`growing-steps`, {n_seeds} seeds, else the same; added after the "
        f"protocol): in the second half the predators gain {gain('predators')}, and the prey {gain('prey')}."
    )
    if n_seeds <= n_looked:
        return told
    predators, prey = (gain(role, slice(n_looked, None)) for role in ROLES)
    verdict = "both sides still improve" if min(predators.low, prey.low) > 0 else "it is not shown that both improve"
    return (
        f"{told} The first {n_looked} seeds were a first look. In the other {n_seeds - n_looked}, which alone count as "
        f"a test, the predators gain {predators} and the prey {prey}: **{verdict}** in the second half. (The small p "
        f"of its lesser gain below says that the lesser side falls back less than by chance, not that it improves.)"
    )


_CONTRASTS = (
    "`race` less each other condition, against the panel: Hodges-Lehmann differences between seeds [95% interval], "
    "and p of the rank test (Holm over this table)."
)
_LESSER = "The lesser side's gain, mean over seeds, with its p against runs read backwards (Holm over this table)."
_EXPLOITERS = (
    "What the runs' own exploiters reach within 20 generations against the champion of the moment: prey caught by "
    "exploiting predators, prey not caught of exploiting prey; means of three exploiters in turn."
)
