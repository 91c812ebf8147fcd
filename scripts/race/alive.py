"""ESP whose genes stay small, or whose mutations grow with them: conditions of ``conditions-3v1.toml``."""

from __future__ import annotations

from typing import Any, Self

import numpy as np

from esp_trainer.arrays import Fitness
from esp_trainer.esp.subpopulations import Subpopulations


class Alive(Subpopulations):
    """``esp`` against the growth of genes, which saturates networks while the scale of mutations stays the same.

    Options, each off by default:
        bound: Largest absolute value of a gene; larger ones are cut after breeding.
        decay: Fraction that every gene loses in each generation.
        step: Scale of mutations, as a fraction of the mean absolute value of the side's genes.
    """

    bound, decay, step = np.inf, 0.0, 0.0

    @classmethod
    def start(cls, *given: Any, bound: float = bound, decay: float = decay, step: float = step) -> Self:
        """Return subpopulations with uniform random genes, as ``esp`` begins."""
        started = super().start(*given)
        started.bound, started.decay, started.step = bound, decay, step
        return started

    def tell(self, fitness: Fitness, champions: np.ndarray, generator: np.random.Generator) -> float:
        """Breed the next generation as ``esp`` does, with these options."""
        if self.step:
            self.config = self.config.replace(mutation_scale=self.step * self.spread().scale)
        share = super().tell(fitness, champions, generator)
        np.clip(self.genomes, -self.bound, self.bound, out=self.genomes)
        self.genomes *= 1 - self.decay
        return share
