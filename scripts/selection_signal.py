"""Measure the signal that selection has, and the progress it makes, where the truth is known: a Markdown table.

Each neuron adds a known amount to the fitness of its team, the more the nearer its genes are to a target; trials add
noise. ESP breeds as in the game. So one can see what fraction of the differences between neurons selection sees, and
how near the genes come to the target.

    python scripts/selection_signal.py            # four minutes
    python scripts/selection_signal.py --quick    # to see that it works
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from typing import Any

import numpy as np
from study import table

from esp_trainer.analysis.inference import summary
from esp_trainer.config import EspConfig, SideConfig
from esp_trainer.esp.controller import make_controller
from esp_trainer.esp.subpopulations import Subpopulations

N_AGENTS = 3
CONTROLLER = make_controller(SideConfig(), np.array([[0, 1]]), 4)
NO_CHAMPIONS = np.empty((0, N_AGENTS, *CONTROLLER.shape), np.float32)
NOISE = 100.0  # standard deviation of a trial; that of the sum of a random team's contributions is 35 to 38


@dataclass(frozen=True)
class Design:
    """A way to score neurons."""

    name: str
    esp: dict[str, Any]
    noise: float = NOISE


CONDITIONS = (
    Design("100 neurons", {}),
    Design("25 neurons", {"subpopulation_size": 25}),
    Design("200 neurons", {"subpopulation_size": 200}),
    Design("100 neurons, half the noise variance (blocks)", {}, NOISE / np.sqrt(2)),
    Design("100 neurons, four times the trials", {"n_trials": 4000}),
    Design("100 neurons, memory 0.8", {"memory": 0.8}),
    Design("100 neurons, memory 0.8, 100 prior trials", {"memory": 0.8, "prior_trials": 100.0}),
)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="small and meaningless, to see that it works")
    options = parser.parse_args()
    generations, seeds = (6, 2) if options.quick else (300, 4)
    heads, rows = ["scored by", "signal, first tenth", "signal, last tenth", "distance to the target"], []
    for condition in CONDITIONS:
        found = np.array([evolve(condition, generations, seed) for seed in range(seeds)])
        rows.append([condition.name, *map(summary, found.T)])
    print(table(heads, rows, "---:"))


def evolve(condition: Design, generations: int, seed: int) -> tuple[float, float, float]:
    """Return the signal of selection early and late, and the mean squared distance of the genes in the end."""
    config = EspConfig(**{"hof_mates": 0, **condition.esp})
    population = Subpopulations.start(config, CONTROLLER, N_AGENTS, np.random.default_rng(seed))
    target = np.random.default_rng(1000 + seed).normal(0, 4, NO_CHAMPIONS.shape[1:])[:, :, :, None]
    signals = []
    for number in range(generations):
        generator = np.random.default_rng((seed, number))
        worth = -((population.genomes - target) ** 2).sum(axis=-1) / 10
        chosen = population.ask(generator).indices.transpose(1, 2, 3, 0).astype(int)
        team = np.take_along_axis(worth, chosen, axis=-1).sum(axis=(0, 1, 2))
        fitness = team + generator.normal(0, condition.noise, len(team))
        signals.append(population.tell(np.repeat(fitness[:, None], N_AGENTS, axis=1), NO_CHAMPIONS, generator))
    tenth = max(1, generations // 10)
    distance = float(((population.genomes - target) ** 2).mean())
    return float(np.mean(signals[:tenth])), float(np.mean(signals[-tenth:])), distance


if __name__ == "__main__":
    main()
