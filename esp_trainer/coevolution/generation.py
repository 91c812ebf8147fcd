"""The results of a generation, as coevolution returns them and a run records them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from esp_trainer.algorithm import Spread
from esp_trainer.arrays import NeuronIndices
from esp_trainer.coevolution.champions import Champion
from esp_trainer.coevolution.trials import Trials
from esp_trainer.esp.signal import Signal
from esp_trainer.esp.subpopulations import Parents
from esp_trainer.statistics import Captures, Payoffs
from esp_trainer.types import Role


class Bred(NamedTuple):
    """The parents of the neurons that one side bred."""

    parents: Parents
    """Parents of the new neurons. Past champions are named by their generation."""
    champion: NeuronIndices
    """Slot of each neuron of the generation's champion before it bred, int ``(S,)``."""
    burst: bool
    """True if the side then started again around this champion."""


@dataclass(frozen=True)
class Generation:
    """The results of a generation."""

    number: int
    trials: dict[Role, Trials]
    champions: dict[Role, Champion]
    spreads: dict[Role, Spread]
    """Diversity and scale of the genes that the teams were sampled from."""
    signals: dict[Role, Signal]
    """Signal of each side's selection."""
    held_out: Captures | Payoffs
    """Results of champion against champion, or against the fixed side, from the held-out starts."""
    seconds: dict[str, float]
    """Wall time of each phase, in seconds."""
    exploited: dict[Role, float] = field(default_factory=dict)
    """Mean payoff to the predators in the episodes of each side's new exploiter; empty if the generation added none. In
    the predator-prey world it is the fraction of the prey caught."""
    bred: dict[Role, Bred] = field(default_factory=dict)
    """Parents of each side's new neurons, if the run keeps them."""
