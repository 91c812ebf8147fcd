"""Evolve networks of your own: leaky neurons, which keep a part of what they were in the step before.

Run: `python examples/own_network.py`. It takes 3 CPU-seconds, and 18 more to compile. It prints

    leaky: the champions catch 0.17 of the prey at first, 0.96 in the end
    feedforward: the champions catch 0.24 of the prey at first, 0.92 in the end

From the command line, with the class in `my_module.py`: `esp-trainer train pond --predators.network my_module:Leaky`.
Such runs resume, and replays, the page, `analyse` and `compare` know them as any other.
"""

import sys
from typing import NamedTuple

import numpy as np

from esp_trainer import Coevolution, FusedEvaluator, new_sides, preset
from esp_trainer.networks import logistic, respond, weighted_sum
from predprey_env.jit import add_products, bits_of, float_of, fma, load, rule, store, zeros

N_GENERATIONS = 3 if "--quick" in sys.argv else 40
FIELDS = {"prey.policy": "flee_nearest", "esp.past_share": 0, "esp.exploiters_every": 0, "champion.n_past": 0}
HALF = np.float32(0.5)


class Leaky(NamedTuple):
    n_hidden: int
    n_genes: int
    n_memory: int
    blank: tuple

    @staticmethod
    def genes(n_inputs, n_outputs, n_hidden):
        return n_inputs + n_outputs  # weights of one hidden neuron

    @staticmethod
    def memory(n_hidden):
        return n_hidden  # rows of one network


@respond.register(Leaky)
@rule  # compiled, for one world or for sixteen side by side
def leaky(network, weights, at, inputs, n_inputs, first, memory, context):
    outputs = zeros(weights, network.blank)
    for neuron in range(network.n_hidden):
        z = weighted_sum(weights, at, inputs, n_inputs)
        active = fma(HALF, float_of(load(memory, context + neuron)), HALF * logistic(z))
        store(memory, context + neuron, bits_of(active))
        outputs = add_products(outputs, weights, at + n_inputs + first, active)
        at += network.n_genes
    return outputs


for name, network in (("leaky", f"{__name__}:Leaky"), ("feedforward", "feedforward")):
    config = preset("pond").with_fields(FIELDS | {"predators.network": network})
    run = Coevolution(config, new_sides(config), FusedEvaluator(config.env))
    caught = [run.step(number).held_out.caught.rate for number in range(N_GENERATIONS)]
    print(f"{name}: the champions catch {caught[0]:.2f} of the prey at first, {caught[-1]:.2f} in the end")
