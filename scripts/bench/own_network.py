"""A network outside the package with the arithmetic of the paper's, as a user would write it."""

from __future__ import annotations

from typing import Any

from esp_trainer.networks import logistic, respond
from esp_trainer.networks.feedforward import FeedForward
from predprey_env.jit import add_products, fma, load, rule, zeros


class OwnNetwork(FeedForward):
    """A network with the genes of the paper's, and a rule of its own."""


@rule
def own_network(
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


respond.register(OwnNetwork, own_network)
