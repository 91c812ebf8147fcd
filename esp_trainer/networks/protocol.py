"""Interface of a kind of network: how the genes of its hidden neurons and its inputs become outputs."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from predprey_env.jit.generic import Generic
from predprey_env.jit.linking import inlined
from predprey_env.jit.values import FloatRows, IntegerRows, Values


class Network(Protocol):
    """A kind of network: a named tuple with these fields and methods, and a rule that is registered with
    :data:`respond`.

    The fields are filled in when a controller is made. A kind of your own may have more, with defaults.
    """

    n_hidden: int
    """Number of hidden neurons, as the config says."""
    n_genes: int
    """Number of rows from one hidden neuron's genes to the next; at least the number that the network reads."""
    n_memory: int
    """Number of rows of memory of one network."""
    blank: tuple[np.float32, ...]
    """One zero for each output; compiled code takes the number of outputs from the type."""

    @staticmethod
    def genes(n_inputs: int, n_outputs: int, n_hidden: int) -> int:
        """Return the number of genes of a hidden neuron.

        ``n_inputs`` includes the bias. ``n_outputs`` is the number of actions, times the number of agents of the team
        if the controller is central.
        """
        ...

    @staticmethod
    def memory(n_hidden: int) -> int:
        """Return the number of rows of memory that one network needs; 0 if it remembers nothing."""
        ...


class _Respond(Generic):
    """The class of :data:`respond`."""

    def __call__(
        self,
        network: Any,
        weights: FloatRows,
        at: int,
        inputs: FloatRows,
        n_inputs: int,
        first: int,
        memory: IntegerRows,
        context: int,
    ) -> Values:
        return self.known(network)(network, weights, at, inputs, n_inputs, first, memory, context)


respond = _Respond("respond", "network")
"""Function that returns the outputs of one network, a tuple of values, before their activation.

It calls the rule that is registered for exactly the network's class, ``respond.register(Class)`` above ``@rule``, in
Python as in compiled code.

Args:
    network (Network): The network.
    weights (rows of float32): Genes.
    at (int): Index of the first gene of the first hidden neuron; the next begins ``network.n_genes`` rows later.
    inputs (rows of float32): What the network reads. The last is 1 if there are biases.
    n_inputs (int): Number of inputs, with the bias; at least 2.
    first (int): Index of the first output among all that the neurons have weights for; 0 except for central
        controllers.
    memory (rows of int32): Memory of the agent, all 0 when an episode starts. Floats are stored as their bits
        (:func:`predprey_env.jit.bits_of`).
    context (int): Index of the first of the network's ``network.n_memory`` rows.
"""


@inlined(respond)
def _respond(network, weights, at, inputs, n_inputs, first, memory, context):  # type: ignore[no-untyped-def]
    implementation = respond.registry.get(getattr(network, "instance_class", None))
    if implementation is None:
        return None
    return lambda network, weights, at, inputs, n_inputs, first, memory, context: implementation(
        network, weights, at, inputs, n_inputs, first, memory, context
    )
