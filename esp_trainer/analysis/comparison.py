"""Measures of each run of a condition, and tests over seeds of the differences between conditions.

Every run is measured against panels: fixed opponents, which are the same for all conditions. In-loop success alone does
not show progress, because it changes with the opponent.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from esp_trainer.analysis.conditions import world_of
from esp_trainer.analysis.cross_play import CELL_EPISODES, PANEL, cross_play
from esp_trainer.analysis.history import History
from esp_trainer.analysis.inference import MIN_SEEDS, Comparison, compare, holm
from esp_trainer.analysis.progress import progress
from esp_trainer.arrays import Curve, GenerationIndices, PayoffMatrix, SeedValues
from esp_trainer.tasks import WORLDS
from esp_trainer.teams.zoo import FIRST_ZOO, known_teams, load_team
from esp_trainer.types import ROLES, Evaluator, Role, ScriptedTeams, TeamBatch
from predprey_env.agents import other_team
from predprey_env.config import EnvConfig
from predprey_env.policies import SCRIPTS

PANEL_GENERATIONS = 24
"""Number of generations of a run that meet the panels."""
LEAST = 3
"""Minimum number of generations: progress in the second half needs two."""

Panel = dict[Role, list[TeamBatch]]
"""Fixed opponents, by the side that they play."""
MeasureValues = dict[str, float]
"""Measures of a run by name; nan if a measure cannot be taken."""

HELD_OUT, SCRIPTED = "held_out", "scripts"
KINDS = ("level", "progress", "late_progress")
"""Kinds of measures against a panel: mean result of the last sixth of the generations (level), and last sixth minus
first sixth of the whole run (progress) and of its second half (late progress)."""


def measure_name(role: Role, panel: str, kind: str) -> str:
    """Return the name of a measure against a panel, ``predators_scripts_level`` for example."""
    return f"{role}_{panel}_{kind}"


def held_out_opponents(env: EnvConfig | None, runs: Sequence[History] = (), *, older_only: bool = False) -> Panel:
    """Return opponents that no compared run trained against.

    Args:
        env: The world. If it is a task of the zoo, the zoo's held-out teams for it are included. None for another game.
        runs: Runs of that world that are not themselves compared. Six champions of each evolved side are included.
        older_only: True to leave out the zoo's teams of the race presets.
    """
    found: Panel = {role: [] for role in ROLES}
    tasks = {name for name, task in WORLDS.items() if env and world_of(task) == world_of(env)}
    for team in known_teams().values():
        older = team.preset.startswith(FIRST_ZOO)
        if team.held_out and team.task in tasks and (older or not older_only):
            found[team.role].append(load_team(team.name).as_teams(1))
    for run in runs:
        for role in run.champions:
            found[role].append(run.entrants(role, run.sample(PANEL)))
    return found


def script_panel(*, another_game: bool = False) -> Panel:
    """Return all scripts of both sides; another game than the predator-prey world has only the random script."""
    if another_game:
        return {role: [ScriptedTeams("random")] for role in ROLES}
    return {role: [ScriptedTeams(script) for script in SCRIPTS[role]] for role in ROLES}


def caught_by_each(
    role: Role,
    mine: TeamBatch,
    opponents: Sequence[TeamBatch],
    evaluator: Evaluator,
    *,
    n_episodes: int = CELL_EPISODES,
    seed: int = 0,
) -> PayoffMatrix:
    """Play the teams of a side against all opponents.

    Args:
        role: Side of the teams.
        mine: The teams.
        opponents: Teams of the other side.
        evaluator: Evaluator of their world.
        n_episodes: Number of episodes per pair.
        seed: Seed of the starts.

    Returns:
        Payoff to the predators (fraction of prey caught), float64 ``(n_teams, n_opponents)``.
    """

    def caught(theirs: TeamBatch) -> PayoffMatrix:
        if role == "predators":
            return cross_play(mine, theirs, evaluator, n_episodes=n_episodes, seed=seed).payoff
        return cross_play(theirs, mine, evaluator, n_episodes=n_episodes, seed=seed).payoff.T

    return np.concatenate([caught(theirs) for theirs in opponents], axis=1)


@dataclass(frozen=True)
class MeasuredRun:
    """Measurements of a run."""

    generations: GenerationIndices
    """Generations that met the panels, int ``(G,)``."""
    curves: dict[str, Curve]
    """Mean result of each of these generations, float64 ``(G,)``, higher is better, by side and panel (for example
    ``predators_held_out``). Scripted sides and empty panels have no curve."""
    payoff: Curve
    """Payoff to the predators (fraction of prey caught), champion against champion, float64 ``(n_generations,)``."""
    values: MeasureValues
    """Value of each measure in :func:`measures`."""
    captures: bool = True
    """True if payoffs are fractions of prey caught; False in another game than the predator-prey world."""


@dataclass(frozen=True)
class Condition:
    """Measured runs that differ only in their seeds."""

    name: str
    runs: Sequence[MeasuredRun]

    def known(self, measure: str) -> SeedValues:
        """Return the values of a measure, without those of runs in which it is nan: float64 ``(n,)``."""
        values = np.array([run.values[measure] for run in self.runs], np.float64)
        return values[~np.isnan(values)]


def measures(*, captures: bool = True) -> list[str]:
    """Return the names of all measures of a run, in the order in which they are reported.

    Measures against panels are the fraction of prey caught for predators, and the fraction not caught for prey.
    ``caught`` is the fraction of prey caught, champion against champion, in the last third of the run. In another game
    all measures are payoffs, and ``caught`` is named ``payoff``.
    ``predators_signal`` and ``prey_signal`` are the mean signal of selection over the run.
    """
    panels = [measure_name(role, panel, kind) for panel in (HELD_OUT, SCRIPTED) for role in ROLES for kind in KINDS]
    return [*panels, "caught" if captures else "payoff", *(f"{role}_signal" for role in ROLES)]


def measure_history(
    history: History,
    panels: Mapping[str, Panel],
    evaluator: Evaluator,
    *,
    n_generations: int = PANEL_GENERATIONS,
    n_episodes: int = CELL_EPISODES,
) -> MeasuredRun:
    """Measure the champions of generations evenly spread over a run.

    Args:
        history: The run.
        panels: Opponents by the name of their panel.
        evaluator: Evaluator of the run's world.
        n_generations: Number of generations to sample, at least three.
        n_episodes: Number of episodes per pair.

    Returns:
        The measurements. The signal of selection is nan, because a history does not hold it.

    Raises:
        ValueError: Fewer than three generations can be sampled.
    """
    generations = history.sample(n_generations)
    if len(generations) < LEAST:
        raise ValueError(f"progress takes at least {LEAST} generations, got {len(generations)}")
    captures = not history.config.game.environment
    total = 1.0 if captures else 0.0
    values, curves = dict.fromkeys(measures(captures=captures), float("nan")), {}
    for role in history.champions:
        mine = history.entrants(role, generations)
        for panel, opponents in panels.items():
            if not opponents[other_team(role)]:
                continue
            payoff = caught_by_each(role, mine, opponents[other_team(role)], evaluator, n_episodes=n_episodes)
            results = payoff if role == "predators" else total - payoff
            whole, late = progress(results, total), progress(results[len(results) // 2 :], total)
            curves[f"{role}_{panel}"] = whole.curve
            for kind, value in zip(KINDS, (whole.level, whole.strength, late.strength), strict=True):
                values[measure_name(role, panel, kind)] = value
    in_loop = history.payoff
    values["caught" if captures else "payoff"] = float(in_loop[-max(1, len(in_loop) // 3) :].mean())
    return MeasuredRun(generations, curves, in_loop, values, captures)


@dataclass(frozen=True)
class Contrast:
    """The difference between a condition and the baseline in one measure."""

    condition: str
    measure: str
    difference: float
    """Hodges-Lehmann estimate of the difference. With too few seeds for a comparison: difference of the means."""
    comparison: Comparison | None
    """Interval and test; None if either has fewer seeds than :data:`~esp_trainer.analysis.inference.MIN_SEEDS`."""
    p: float | None = None
    """p-value, corrected by Holm's procedure over all contrasts that are reported together; None without a test."""


def contrasts(conditions: Sequence[Condition], baseline: Condition, names: Sequence[str]) -> list[Contrast]:
    """Compare every other condition with the baseline in each named measure.

    A measure that no run of the condition, or no run of the baseline, has is skipped.
    """
    found: list[Contrast] = []
    for condition in conditions:
        if condition is baseline:
            continue
        for name in names:
            mine, its = condition.known(name), baseline.known(name)
            if min(len(mine), len(its)) >= MIN_SEEDS:
                compared = compare(mine, its)
                found.append(Contrast(condition.name, name, compared.difference, compared))
            elif len(mine) and len(its):
                found.append(Contrast(condition.name, name, float(mine.mean() - its.mean()), None))
    return _corrected(found)


def _corrected(found: Sequence[Contrast]) -> list[Contrast]:
    corrected = iter(holm([each.comparison.p for each in found if each.comparison]).tolist())
    return [
        Contrast(each.condition, each.measure, each.difference, each.comparison, next(corrected))
        if each.comparison
        else each
        for each in found
    ]
