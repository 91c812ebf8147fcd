"""Breed the predators by tournaments instead of ESP's truncation, and compare both against the same fixed prey.

Run: `python examples/own_selection.py`. It takes 4 CPU-seconds, and 14 more the first time, to compile. It prints

    esp                : the champions catch 0.09 of the prey at first, 0.60 in the last ones
    __main__:Tournament: the champions catch 0.09 of the prey at first, 0.54 in the last ones

One seed shows no difference that counts; run several. From the command line, with the class in `my_module.py`:
`esp-trainer train 3v1 --predators.algorithm my_module:Tournament`.
"""

import sys

import numpy as np

from esp_trainer import Coevolution, FusedEvaluator, Subpopulations, new_sides, preset
from esp_trainer.esp import operators

QUICK = "--quick" in sys.argv  # few generations of few trials
N_GENERATIONS = 3 if QUICK else 30
FIELDS = {"prey.policy": "flee_nearest", "esp.n_trials": 200 if QUICK else 1000, "seed": 0}


class Tournament(Subpopulations):
    """Subpopulations in which each parent is the best of three random neurons; all neurons die after a generation."""

    def ask(self, generator):
        """Return the teams of a generation's trials, and remember which neuron each of them used."""
        self.teams = self.draw(generator, self.config.n_trials)
        return self.teams

    def tell(self, fitness, champions, generator):
        """Breed from the fitness of each agent of each team, ``(n_trials, n_agents)``."""
        esp, size = self.config, self.config.subpopulation_size
        used = np.repeat(self.controller.used_genes, self.controller.n_hidden)
        for agent, genomes in enumerate(self.genomes):  # (n_networks, n_hidden, size, n_genes)
            chosen = self.teams.indices[:, agent].reshape(esp.n_trials, -1)
            total, times = operators.sums_by_neuron(chosen, fitness[:, agent], size)
            score = np.where(times > 0, total / np.maximum(times, 1), -np.inf)
            rows = np.arange(len(score))[:, None, None]
            entrants = generator.integers(0, size, (len(score), size, 3))
            winners = np.take_along_axis(entrants, score[rows, entrants].argmax(axis=2)[..., None], axis=2)[..., 0]
            genes = genomes.reshape(len(score), size, -1)
            parents = genes[rows[..., 0], winners]
            children = operators.one_point_crossover(generator, parents[:, ::2], parents[:, 1::2], used)
            operators.mutate(generator, children, used, esp.mutation_rate, esp.mutation_scale, esp.mutation_limit)
            genes[:] = children


evaluator = FusedEvaluator(preset("paper-3v1").env)
for algorithm in ("esp", f"{__name__}:Tournament"):
    config = preset("paper-3v1").with_fields(FIELDS | {"predators.algorithm": algorithm})
    run = Coevolution(config, new_sides(config), evaluator)
    caught = [run.step(number).held_out.caught.rate for number in range(N_GENERATIONS)]
    first, last = caught[0], np.mean(caught[-5:])
    print(f"{algorithm:19}: the champions catch {first:.2f} of the prey at first, {last:.2f} in the last ones")
