"""Do both sides change? A first look at the four main presets over a few seeds, as Markdown.

For each run: the share of prey that trial teams catch, in the first and in the last sixth of the generations; and,
because that share moves with both sides, how the late predators do against the early prey and the early predators
against the late ones: champions from both sixths, from starts that no selection saw. The arms race is measured
properly elsewhere; this is the sanity check that the figures known beforehand are met.

    python scripts/first_runs.py --generations 240 --seeds 2 > docs/first-runs.md
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path

import numpy as np

from esp_trainer import RunConfig, Team, preset
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.evaluation.match import match
from esp_trainer.run.directory import RunDirectory
from esp_trainer.run.trainer import Trainer

NAMES = ("monolithic-3v2", "paper-3v2", "monolithic-3v1", "paper-3v1")
CHAMPIONS = 5
"""Champions taken from each sixth of a run; each meets each of the other side's."""
EPISODES = 80
"""Episodes of each meeting."""


def main() -> None:
    """Run everything and print the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--generations", type=int, default=240)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--presets", nargs="+", default=NAMES, choices=NAMES)
    options = parser.parse_args()
    print(f"# First runs\n\n`{' '.join(['python', 'scripts/first_runs.py', *sys.argv[1:]])}`\n")
    print(f"{options.generations} generations; *early* and *late* are the first and the last sixth of them.")
    print("*Late hunt early*: the share of prey that late predators catch of early prey, on held-out starts.\n")
    print("| preset | seed | caught in trials, early | late | late hunt early | early hunt late |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name in options.presets:
        for seed in range(options.seeds):
            config = preset(name).replace(seed=seed, generations=options.generations)
            figures = " | ".join(f"{figure:.2f}" for figure in look(config))
            print(f"| `{name}` | {seed} | {figures} |", flush=True)


def look(config: RunConfig) -> list[float]:
    """Run a config and say what its columns hold."""
    with tempfile.TemporaryDirectory() as place:
        directory = RunDirectory(Path(place) / "run")
        trainer = Trainer.start(directory, config, lambda config: FusedEvaluator(config.env))
        for _ in trainer.generations():
            pass
        records = [json.loads(line) for line in directory.metrics_file.read_text().splitlines()]
        caught = [record["trials"]["predators"]["caught"] for record in records]
        sixth = max(1, len(caught) // 6)
        early, late = range(sixth), range(len(caught) - sixth, len(caught))
        return [
            float(np.mean(caught[:sixth])),
            float(np.mean(caught[-sixth:])),
            cross(directory, config, late, early),
            cross(directory, config, early, late),
        ]


def cross(directory: RunDirectory, config: RunConfig, predators: range, prey: range) -> float:
    """Share of prey caught by champions of some generations against champions of others."""
    rates = []
    for hunters in np.linspace(predators[0], predators[-1], CHAMPIONS).astype(int):
        for hunted in np.linspace(prey[0], prey[-1], CHAMPIONS).astype(int):
            teams = [
                Team.load(directory.champion_file("predators", hunters)),
                Team.load(directory.champion_file("prey", hunted)),
            ]
            rates.append(match(*teams, config.env, EPISODES, seed=1).caught.rate)
    return float(np.mean(rates))


if __name__ == "__main__":
    main()
