"""How exploitable evolved teams are by generation, on a torus where the best response is known; and scripts."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import matplotlib as mpl
import numpy as np
from tqdm import tqdm

from esp_trainer.analysis.history import History
from esp_trainer.analysis.inference import Estimate, over_seeds
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.exact.chances import chances
from esp_trainer.exact.response import best_response
from esp_trainer.exact.solution import Solution, by_parity, means_by_parity, solve
from esp_trainer.presets import preset
from esp_trainer.types import ROLES, Role, ScriptedTeams
from predprey_env.config import EnvConfig

PRESETS = ("paper-3v1", "modern-3v1", "drawn-3v1")
"""Controllers that take the action with the most votes, those with scaled offsets, and those that draw."""
SAMPLED = 8
"""Generations of each run."""
SCRIPTS: dict[Role, tuple[str, ...]] = {
    "predators": ("random", "greedy_chase", "parity_chase", "surround"),
    "prey": ("random", "flee_nearest"),
}


class Races(NamedTuple):
    """Everything by time: the share of prey caught within 1, 2, ... steps, over all starts."""

    size: int
    seeds: int
    optimal: np.ndarray
    """``(horizon,)``: both sides play optimally."""
    generations: np.ndarray
    """Those that were measured."""
    evolved: dict[tuple[str, Role], np.ndarray]
    """``(seeds, generations, horizon)``: the role's champion meets the best response to it."""
    met: dict[str, np.ndarray]
    """``(seeds, generations)``: champions met each other, to the end."""
    scripts: dict[tuple[str, Role], np.ndarray]
    """``(horizon,)``."""

    @property
    def half(self) -> int:
        """The number of steps in which optimal play catches nearest to half of the prey."""
        return int(np.abs(self.optimal - 0.5).argmin()) + 1

    def at(self, name: str, role: Role, generation: int, steps: int) -> Estimate:
        """Mean over seeds of what is caught of, or by, a generation's champions."""
        return over_seeds(self.evolved[name, role][:, generation, steps - 1])


def measure(size: int, seeds: int, generations: int) -> Races:
    """Evolve the presets on a torus of that size, and answer their champions optimally."""
    config = EnvConfig(size=size, n_prey=1, max_cycles=size * 3 // 2)
    solution = solve(config, config.max_cycles)
    optimal = np.array([by_parity(solution, steps)[0] for steps in range(1, config.max_cycles + 1)])
    scripts = {
        (script, role): _answered(chances(ScriptedTeams(script), role, config), role, solution)
        for role, names in SCRIPTS.items()
        for script in names
    }
    evolved: dict[tuple[str, Role], list[list[np.ndarray]]] = {(name, role): [] for name in PRESETS for role in ROLES}
    met: dict[str, list[np.ndarray]] = {name: [] for name in PRESETS}
    kept = np.unique(np.linspace(0, generations - 1, SAMPLED).round().astype(int))
    with tqdm(total=len(PRESETS) * seeds, unit="run", mininterval=10) as bar:
        for name in PRESETS:
            for seed in range(seeds):
                run = preset(name).replace(seed=seed, generations=generations, env=config)
                history = History.evolve(run, FusedEvaluator(config))
                for role in ROLES:
                    teams = [history.team(role, int(generation)) for generation in kept]
                    curves = [_answered(chances(team, role, config), role, solution) for team in teams]
                    evolved[name, role].append(curves)
                met[name].append(history.curves["caught"][kept])
                bar.update()
    return Races(
        size,
        seeds,
        optimal,
        kept,
        {key: np.array(curves) for key, curves in evolved.items()},
        {name: np.array(caught) for name, caught in met.items()},
        scripts,
    )


def _answered(fixed: np.ndarray, role: Role, solution: Solution) -> np.ndarray:
    """Share of prey caught within 1, 2, ... steps when a policy meets the best response for just so many."""
    found: list[float] = []
    config = solution.config
    best_response(
        fixed, role, config, config.max_cycles, lambda values: found.append(means_by_parity(values, config)[0])
    )
    return np.array(found)


def draw(races: Races, file: Path) -> None:
    """What is caught of the last champions, and by them, by time, beside optimal play."""
    mpl.use("agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(5.5, 4.2), layout="constrained")
    steps = np.arange(1, len(races.optimal) + 1)
    axes.plot(steps, races.optimal, "k", label="both optimal")
    for (name, role), curve in races.scripts.items():
        if role == "prey":
            axes.plot(steps, curve, ":", label=f"prey {name}, answered optimally")
    for name in PRESETS:
        axes.plot(steps, races.evolved[name, "prey"][:, -1].mean(axis=0), label=f"prey of {name}, answered optimally")
        axes.plot(steps, races.evolved[name, "predators"][:, -1].mean(axis=0), "--", label=f"predators of {name}")
    axes.set(xlabel="steps", ylabel="share of prey caught", title=f"The last champions, {races.size} x {races.size}")
    axes.legend(fontsize=7)
    figure.savefig(file, dpi=120)
    plt.close(figure)
