"""A network outside the package with the arithmetic of the paper's, as a user would write it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from esp_trainer.networks import logistic, respond
from predprey_env.jit import add_products, fma, load, rule, zeros


class Own(NamedTuple):
    """A feed-forward network."""

    n_hidden: int
    n_genes: int
    n_memory: int
    blank: tuple[np.float32, ...]

    @staticmethod
    def genes(n_inputs: int, n_outputs: int, n_hidden: int) -> int:  # noqa: ARG004
        """Return the number of genes of a hidden neuron."""
        return n_inputs + n_outputs

    @staticmethod
    def memory(n_hidden: int) -> int:  # noqa: ARG004
        """Return 0."""
        return 0


@rule
def own(
    network: Any,
    weights: Any,
    at: int,
    inputs: Any,
    n_inputs: int,
    first: int,
    memory: Any,  # noqa: ARG001
    context: int,  # noqa: ARG001
) -> Any:
    """Return the outputs of a network."""
    outputs = zeros(weights, network.blank)
    for _ in range(network.n_hidden):
        z = load(weights, at) * load(inputs, 0)
        for i in range(1, n_inputs):
            z = fma(load(weights, at + i), load(inputs, i), z)
        outputs = add_products(outputs, weights, at + n_inputs + first, logistic(z))
        at += network.n_genes
    return outputs


respond.register(Own, own)
