"""The answer at the head of ``docs/race.md``."""

from __future__ import annotations

import json

from study import table

from esp_trainer.analysis.gains import Interval
from esp_trainer.analysis.inference import compare
from esp_trainer.types import ROLES, Role
from race import courses, endpoints, exploitability, long
from race.endpoints import told_level
from race.measure import Arrays, Task
from race.tables import marked

SETTINGS = {
    "race": "the recommended setting",
    "race-monolithic": "one network an agent, about half as many weights",
    "race-matched": "one network an agent, as many weights",
    "no-memory": "scores are not kept over generations",
    "growing-steps": "mutations that grow with the genes",
    "bias-pool": "the paper's setting, bias genes, past champions",
    "bias": "the paper's setting, bias genes",
    "pool": "the paper's setting, past champions",
    "paper": "the paper's setting",
}
"""Conditions of `steppe` in words, in the order of the table."""
LOOKED_AT = (100, 101, 102, 103, 104, 109, 110)
"""Seeds of `steppe` whose results were known before the last of the twenty ran."""


def in_short(tasks: dict[str, Task]) -> str:
    """Return what became of one prey, and of two on `steppe`, in the recommended setting: a list in Markdown."""
    steppe, one_prey = tasks.get("steppe", {}), tasks.get("3v1", {})
    told = [_two_prey(steppe["race"])] if "race" in steppe else []
    told += [long.in_short(steppe[long.CONDITION])] if long.CONDITION in steppe else []
    told += [_two_prey_splitting(steppe)] if {"race", "race-monolithic"} <= steppe.keys() else []
    told += [_one_prey(one_prey), _one_prey_splitting(one_prey)]
    told += [courses.in_short(steppe), exploitability.in_short(steppe["race"])] if "race" in steppe else []
    listed = "\n".join(f"- {each}" for each in told if each)
    return f"{listed}\n\n{_TABLE}\n\n{_settings(steppe)}" if "race" in steppe else listed


def _two_prey(race: Arrays) -> str:
    n = len(race["config"])

    def gain(role: Role, seeds: slice | list[int] = slice(None)) -> Interval:
        return endpoints.mean_gain(race, role, half=True, seeds=seeds)

    predators, prey = gain("predators"), gain("prey")
    if n < endpoints.ENOUGH or min(predators.low, prey.low) <= 0:
        sides = "; ".join(f"the {role} {_course(race, role)}" for role in ROLES)
        return f"**With two prey on 40 x 40 cells** (`race-steppe`, {n} seeds) {sides}."
    unseen = [i for i, config in enumerate(race["config"]) if json.loads(str(config))["seed"] not in LOOKED_AT]
    return (
        f"**Yes, for 1,500 generations, with two prey on 40 x 40 cells** (`race-steppe`, {n} seeds). In the second "
        f"half the predators still gain {predators} against opponents that nobody trained on, and the prey {prey}. "
        f"The world was chosen when the race with one prey was known, and {n - len(unseen)} seeds were looked at "
        f"before the rest ran; in the other {len(unseen)} alone the gains are {gain('predators', unseen)} and "
        f"{gain('prey', unseen)}."
    )


def _two_prey_splitting(found: Task) -> str:
    split, single = found["race"], found["race-monolithic"]
    lower = [compare(*(endpoints.level(each, role, "panel") for each in (split, single))).low > 0 for role in ROLES]
    head = "Splitting helps both sides there" if all(lower) else "What splitting does there"
    sides = "; ".join(f"the {role} {_course(single, role)}" for role in ROLES)
    matched = " A network of as many weights is no better (`race-matched`)." * ("race-matched" in found)
    return (
        f"**{head}.** With one network an agent (`race-monolithic`, {len(single['config'])} seeds) {sides}.{matched} "
        f"The table below has the levels."
    )


def _one_prey(found: Task) -> str:
    if not {"race", "paper"} <= found.keys():
        return "Nothing is measured yet that the recommended setting can be compared with."
    race, paper = found["race"], found["paper"]
    sides = "; ".join(f"the {role} {_course(race, role)}" for role in ROLES)
    return (
        f"**With one prey on the paper's torus** (`race-3v1`, {len(race['config'])} seeds) {sides}. In the end "
        f"{told_level(race)}; in the paper's setting {told_level(paper)}."
    )


def _one_prey_splitting(found: Task) -> str:
    if not {"race", "race-monolithic"} <= found.keys():
        return ""
    escaped, single = (endpoints.level(found[name], "prey", "panel").mean() for name in ("race", "race-monolithic"))
    return (
        f"**What splitting does there**: {escaped:.2f} of split prey escape the panel, and {single:.2f} of "
        f"prey with one network that sees all predators.{exploitability.of_splitting(found)}"
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
    return "do not measurably improve"


def _settings(found: Task) -> str:
    """Return a table of the second-half gains and the final levels of all conditions of `steppe` in words."""
    rows = []
    for name, words in SETTINGS.items():
        if name in found:
            arrays = found[name]
            gains = (str(endpoints.mean_gain(arrays, role, half=True)) for role in ROLES)
            levels = (f"{endpoints.level(arrays, role, 'panel').mean():.2f}" for role in ROLES)
            rows.append([f"{words}, {marked(name, len(arrays['config']))}", len(arrays["config"]), *gains, *levels])
    gained, reached = (f"{role} gain" for role in ROLES), ("caught", "escaped")
    return table(["setting", "seeds", *gained, *reached], rows)


_TABLE = (
    "Two prey on 40 x 40 cells, by setting: gains in the second half of 1,500 generations against the panel [95% "
    "interval], and the fraction of the panel's prey that is caught, and of the prey that escapes the panel, in the "
    "end (†: fewer than 10 seeds, a first look)."
)
