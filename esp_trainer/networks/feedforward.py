"""The paper's network: inputs, one layer of logistic hidden neurons, outputs (section V)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from esp_trainer.networks.activations import logistic, weighted_sum
from esp_trainer.networks.protocol import respond
from predprey_env.jit.compilation import rule
from predprey_env.jit.floats import add_products, zeros
from predprey_env.jit.values import FloatRows, IntegerRows, Values


class FeedForward(NamedTuple):
    """A network without memory. A hidden neuron's genes are its input weights, then its output weights."""

    n_hidden: int
    n_genes: int
    n_memory: int
    blank: tuple[np.float32, ...]

    @staticmethod
    def genes(n_inputs: int, n_outputs: int, n_hidden: int) -> int:
        """Return the number of genes of a hidden neuron."""
        return n_inputs + n_outputs

    @staticmethod
    def memory(n_hidden: int) -> int:
        """Return 0."""
        return 0


@rule
def feed_forward(
    network: FeedForward,
    weights: FloatRows,
    at: int,
    inputs: FloatRows,
    n_inputs: int,
    first: int,
    memory: IntegerRows,
    context: int,
) -> Values:
    """Return the outputs of a network; see :data:`esp_trainer.networks.protocol.respond`."""
    outputs = zeros(weights, network.blank)
    for _ in range(network.n_hidden):
        active = logistic(weighted_sum(weights, at, inputs, n_inputs))
        outputs = add_products(outputs, weights, at + n_inputs + first, active)
        at += network.n_genes
    return outputs


respond.register(FeedForward, feed_forward)
