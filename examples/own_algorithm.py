"""Breed the predators by an algorithm of your own: keep the best team, and try random changes of it.

Run: `python examples/own_algorithm.py`. It takes 3 CPU-seconds, and 14 more the first time, to compile. It prints

    own: the champions catch 0.04 of the prey at first, 0.61 in the end
    esp: the champions catch 0.24 of the prey at first, 0.92 in the end

From the command line, with the class in `my_module.py`: `esp-trainer train pond --predators.algorithm
my_module:HillClimber`. Such runs resume, and the page, `analyse` and `compare` know them as any other.
"""

import sys
from typing import ClassVar

from esp_trainer import Coevolution, FusedEvaluator, new_sides, preset
from esp_trainer.algorithms import WholeTeams

N_GENERATIONS = 3 if "--quick" in sys.argv else 40
FIELDS = {"prey.policy": "flee_nearest", "esp.past_share": 0, "esp.exploiters_every": 0, "champion.n_past": 0}


class HillClimber(WholeTeams):
    """A team is a vector of all its genes; coevolution plays the vectors and tells their mean fitness."""

    OPTIONS: ClassVar = {"n_teams": 100, "step": 1.0}  # set by --predators.algorithm_options '{"step": 0.5}'

    def begin(self, generator):
        """Start from a random team."""
        (self.best,) = self.first_vectors(1, generator)

    def vectors(self, generator):
        """Return the teams that are played: the best so far, and changes of it."""
        changes = generator.standard_normal((self.n_teams, self.n_parameters)) * self.options["step"]
        changes *= generator.random(changes.shape) < 0.1
        changes[0] = 0
        return self.best + changes

    def learn(self, vectors, scores, generator):
        """Go on from the mean fitness of each team, higher is better."""
        self.best = vectors[scores.argmax()]

    def around(self, vector, generator):
        """Start again around a team, for `esp.burst_after`."""
        self.best = vector

    def state(self):
        """Return what checkpoints hold."""
        return {"best": self.best}

    def restore(self, state):
        """Take on a state."""
        self.best = state["best"].copy()


for name, algorithm in (("own", f"{__name__}:HillClimber"), ("esp", "esp")):
    config = preset("pond").with_fields(FIELDS | {"predators.algorithm": algorithm})
    run = Coevolution(config, new_sides(config), FusedEvaluator(config.env))
    caught = [run.step(number).held_out.caught.rate for number in range(N_GENERATIONS)]
    print(f"{name}: the champions catch {caught[0]:.2f} of the prey at first, {caught[-1]:.2f} in the end")
