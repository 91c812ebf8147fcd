"""The answer at the head of ``docs/race.md``."""

from __future__ import annotations

import json

from esp_trainer.analysis.gains import Interval
from esp_trainer.analysis.inference import compare
from esp_trainer.types import ROLES, Role
from race import courses, endpoints, exploitability, long, tables
from race.endpoints import told_level
from race.measure import Arrays, Task

OTHERS = {
    "race-monolithic": "With one network an agent**, which sees all opponents and has about half as many weights",
    "race-matched": "With one network an agent of as many weights**",
    "bias-pool": "With bias genes and past champions**, and nothing else of the recommended setting",
    "paper": "In the paper's setting on these cells**",
}
"""Conditions of `steppe` that are told of, and the beginnings of what is told."""
PREY = {"steppe": "two prey on 40 x 40 cells", "3v1": "one prey on the paper's torus"}
LOOKED_AT = (100, 101, 102, 103, 104, 109, 110)
"""Seeds of `steppe` whose results were known before the last of the twenty ran."""


def in_short(tasks: dict[str, Task]) -> str:
    """Return what became of one prey, and of two on `steppe`, in the recommended setting: a list in Markdown."""
    steppe = tasks.get("steppe", {})
    told = [_two_prey(steppe["race"]), courses.in_short(steppe)] if "race" in steppe else []
    told += [long.in_short(steppe[long.CONDITION])] if long.CONDITION in steppe else []
    told += [_other(name, steppe) for name in OTHERS if {"race", name} <= steppe.keys()]
    told.append(_one_prey(tasks.get("3v1", {})))
    told += [
        exploitability.in_short(tasks[task]["race"], of) for task, of in PREY.items() if "race" in tasks.get(task, {})
    ]
    return "\n".join(f"- {each}" for each in told if each)


def _two_prey(race: Arrays) -> str:
    n = len(race["config"])

    def gain(role: Role, seeds: slice | list[int] = slice(None)) -> Interval:
        return endpoints.mean_gain(race, role, half=True, seeds=seeds)

    predators, prey = gain("predators"), gain("prey")
    if n < endpoints.ENOUGH or min(predators.low, prey.low) <= 0:
        sides = "; ".join(f"the {role} {_course(race, role)}" for role in ROLES)
        return f"**With two prey on 40 x 40 cells** (`steppe`) {sides} ({n} seeds)."
    unseen = [i for i, config in enumerate(race["config"]) if json.loads(str(config))["seed"] not in LOOKED_AT]
    return (
        f"**Yes, with two prey on 40 x 40 cells** (`race-steppe`, {n} seeds). In the second half of 1,500 generations "
        f"both sides still improve against opponents that nobody trained on, the predators by {predators} and the "
        f"prey by {prey}. {n} seeds were planned. The results of {n - len(unseen)} were seen before the rest was "
        f"run; in the {len(unseen)} unseen ones alone the predators gain {gain('predators', unseen)} and the prey "
        f"{gain('prey', unseen)}. The world was chosen when the race with one prey was known. In the end "
        f"{told_level(race)}."
    )


def _other(name: str, found: Task) -> str:
    arrays, (predators, prey) = found[name], (_course(found[name], role) for role in ROLES)
    sides = f"both sides {prey}" if predators == prey else f"the predators {predators}, and the prey {prey}"
    late = {r: compare(*(endpoints.run_gains(each, r, half=True) for each in (arrays, found["race"]))) for r in ROLES}
    less = " and ".join(f"{tables.difference(each)} for the {role}" for role, each in late.items())
    n = len(arrays["config"])
    return (
        f"**{OTHERS[name]} (`{name}`, {n} seeds{', a first look' * (n < endpoints.ENOUGH)}), {sides}; the second-half "
        f"gain less that of the recommended setting is {less}. In the end {told_level(arrays)}."
    )


def _one_prey(found: Task) -> str:
    if not {"race", "paper"} <= found.keys():
        return "Nothing is measured yet that the recommended setting can be compared with."
    race, paper, whole = found["race"], found["paper"], found.get("race-monolithic")
    single = f" Where the prey have one network that sees all predators, {told_level(whole)}." if whole else ""
    return (
        f"**With one prey on the paper's torus** (`race-3v1`, {len(race['config'])} seeds) the prey "
        f"{_course(race, 'prey')}; the predators {_course(race, 'predators')}. In the end {told_level(race)}. In the "
        f"paper's setting {told_level(paper)}.{single}"
    )


def _course(arrays: Arrays, role: Role) -> str:
    """Return in words what a side gained against the panel in the whole run, and in its second half."""
    whole, late = (endpoints.mean_gain(arrays, role, half=half) for half in (False, True))
    if late.low > 0:
        return "improve for the whole run" if whole.low > 0 else "improve in its second half only"
    if late.high < 0:
        return "improve and then fall back in the second half" if whole.low > 0 else "fall back in the second half"
    if whole.low > 0:
        return "improve, but not measurably in the second half"
    return "do not measurably improve, neither over the whole run nor in its second half"
