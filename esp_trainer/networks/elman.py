"""A recurrent network: its hidden neurons also read all hidden activations of the previous step.

Elman, J. L. (1990). Finding structure in time. Cognitive Science 14, 179-211. ESP was made for such networks (Gomez &
Miikkulainen 1997).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from esp_trainer.networks.activations import logistic, weighted_sum
from esp_trainer.networks.protocol import respond
from predprey_env.jit.compilation import rule
from predprey_env.jit.floats import add_products, bits_of, float_of, fma, zeros
from predprey_env.jit.lanes import load, store
from predprey_env.jit.values import FloatRows, IntegerRows, Values


class Elman(NamedTuple):
    """A recurrent network. A hidden neuron's genes are its input weights, its recurrent weights, its output weights.

    All activations are 0 before the first step.
    """

    n_hidden: int
    n_genes: int
    n_memory: int
    blank: tuple[np.float32, ...]

    @staticmethod
    def genes(n_inputs: int, n_outputs: int, n_hidden: int) -> int:
        """Return the number of genes of a hidden neuron."""
        return n_inputs + n_hidden + n_outputs

    @staticmethod
    def memory(n_hidden: int) -> int:
        """Return the rows for the activations of the step before, and for those of this step."""
        return 2 * n_hidden


@rule
def elman(
    network: Elman,
    weights: FloatRows,
    at: int,
    inputs: FloatRows,
    n_inputs: int,
    first: int,
    memory: IntegerRows,
    context: int,
) -> Values:
    """Return the outputs of a network; see :data:`esp_trainer.networks.protocol.respond`."""
    outputs, n_hidden = zeros(weights, network.blank), network.n_hidden
    for neuron in range(n_hidden):
        z = weighted_sum(weights, at, inputs, n_inputs)
        for other in range(n_hidden):
            z = fma(load(weights, at + n_inputs + other), float_of(load(memory, context + other)), z)
        active = logistic(z)
        store(memory, context + n_hidden + neuron, bits_of(active))
        outputs = add_products(outputs, weights, at + n_inputs + n_hidden + first, active)
        at += network.n_genes
    for neuron in range(n_hidden):  # all neurons read the step before, so this step takes its place only now
        store(memory, context + neuron, load(memory, context + n_hidden + neuron))
    return outputs


respond.register(Elman, elman)
