"""The answer at the head of ``docs/race.md``."""

from __future__ import annotations

import json

import numpy as np
from study import table

from esp_trainer.types import ROLES, Role
from race import courses, endpoints, exploitability, long
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


def in_short(tasks: dict[str, Task], by_others: float | None = None) -> str:
    """Return what became of two prey on `steppe`, and of one, as Markdown; for ``by_others`` see :mod:`race.long`."""
    steppe, one_prey = tasks.get("steppe", {}), tasks.get("3v1", {})
    short = [_MEANING]
    short += [_two_prey(steppe["race"])] if "race" in steppe else []
    short += [_one_prey(one_prey)] if "race" in one_prey else []
    told = [long.in_short(steppe[long.CONDITION], by_others)] if long.CONDITION in steppe else []
    told += [_splitting(steppe, one_prey)]
    told += [exploitability.in_short(steppe["race"]), courses.in_short(steppe)] if "race" in steppe else []
    parts = ["\n\n".join(short), "\n".join(f"- {each}" for each in told if each)]
    if "race" in steppe:
        parts[1:1] = [_FIGURE]
        parts += [_TABLE, _settings(steppe)]
    return "\n\n".join(part for part in parts if part)


def _two_prey(race: Arrays) -> str:
    n = len(race["config"])
    predators, prey = (endpoints.mean_gain(race, role, half=True) for role in ROLES)
    if n < endpoints.ENOUGH or min(predators.low, prey.low) <= 0:
        return f"**With two prey on 40 x 40 cells** (`race-steppe`, {n} seeds) {_sides(race)}."
    unseen = [i for i, config in enumerate(race["config"]) if json.loads(str(config))["seed"] not in LOOKED_AT]
    alone = [endpoints.mean_gain(race, role, half=True, seeds=unseen) for role in ROLES]
    gain = [endpoints.run_gains(race, role, half=True) for role in ROLES]
    return (
        f"**With two prey on 40 x 40 cells it does, on average over {n} runs of 1,500 generations** (`race-steppe`): "
        f"the predators gain {predators}, the prey {prey}, and both in {int((np.minimum(*gain) > 0).sum())} of the "
        f"{n} runs. In the {len(unseen)} seeds that were not looked at before all were run the predators gain "
        f"{alone[0]} and the prey {alone[1]}. The world was chosen when the race with one prey was known."
    )


def _one_prey(found: Task) -> str:
    race = found["race"]
    goes_on = min(endpoints.mean_gain(race, role, half=True).low for role in ROLES) > 0
    paper = f"; in the paper's setting {endpoints.told_level(found['paper'])}" if "paper" in found else ""
    own = endpoints.contemporaries(race, "predators")[:, -1].mean()
    return (
        f"**With one prey on the paper's torus it {'does too' if goes_on else 'does not'}** (`race-3v1`, "
        f"{len(race['config'])} runs): {_sides(race)}. In the end {endpoints.told_level(race)}{paper}. The run's own "
        f"last prey they catch {own:.2f} of the time."
    )


def _sides(arrays: Arrays) -> str:
    return "; ".join(f"the {role} {_course(arrays, role)}" for role in ROLES)


def _course(arrays: Arrays, role: Role) -> str:
    """Return in words what a side gained against the panel in the whole run, and in its second half."""
    whole, late = (endpoints.mean_gain(arrays, role, half=half) for half in (False, True))
    if late.low > 0:
        words = "improve for the whole run" if whole.low > 0 else "improve late"
    elif late.high < 0:
        words = "improve and then fall back" if whole.low > 0 else "fall back"
    elif whole.low > 0:
        words = "improve at first, and are not shown to do so later"
    else:
        words = "are not shown to improve"
    return f"{words} (second half {late})"


def _splitting(two: Task, one: Task) -> str:
    """Return what splitting does with two prey and with one, as far as it is known."""

    def levels(found: Task, role: Role) -> str:
        split, single = (endpoints.level(found[name], role, "panel").mean() for name in ("race", "race-monolithic"))
        return f"{split:.2f} and {single:.2f}"

    known = {"race", "race-monolithic"}
    told = []
    if known <= two.keys():
        counts = " and ".join(str(len(two[name]["config"])) for name in ("race", "race-monolithic"))
        told.append(
            f"Two prey: {levels(two, 'prey')} of the prey escape the panel, and the predators catch "
            f"{levels(two, 'predators')} of its prey ({counts} seeds)."
        )
        if "race-matched" in two:
            matched = [endpoints.level(two["race-matched"], role, "panel").mean() for role in ROLES]
            told.append(
                f"A single network of as many weights reaches {matched[1]:.2f} and {matched[0]:.2f} "
                f"({len(two['race-matched']['config'])} seeds)."
            )
    if known <= one.keys():
        told.append(f"One prey: {levels(one, 'prey')} escape the panel.{exploitability.of_splitting(one)}")
    head = "**One network for each opponent that an agent sees, against one for all** (splitting). "
    return (head + " ".join(told)) * bool(told)


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


_MEANING = (
    "We say that a race goes on if both sides still improve in the second half of a run against the *panel*, the teams "
    "of 20 other runs that nobody trains on; a gain is a fraction of the prey."
)
_FIGURE = (
    "![With two prey on 40 x 40 cells: the panel's prey that predators catch, and prey that escape the panel, by "
    "generation and condition](race/level-steppe.png)"
)
_TABLE = (
    "Two prey on 40 x 40 cells, by setting: gains in the second half of 1,500 generations [95% interval]; in the end, "
    "the fraction of the panel's prey that is caught, and of the prey that escapes the panel (†: fewer than 10 seeds, "
    "a first look)."
)
