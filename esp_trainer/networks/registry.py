"""Kinds of network by name."""

from __future__ import annotations

from typing import Any

import numpy as np

from esp_trainer.networks.protocol import respond
from predprey_env.jit.trial import Rows, try_rule
from predprey_env.plugins import call_method, find_class
from predprey_env.settings import brief, error_line

NETWORKS = {
    "feedforward": "esp_trainer.networks.feedforward:FeedForward",
    "elman": "esp_trainer.networks.elman:Elman",
}
"""Name -> class of each kind of network that ships, as ``module:Class``."""

_FIELDS = ("n_hidden", "n_genes", "n_memory", "blank")


def network_class(name: str) -> type[Any]:
    """Return the class of a kind of network by its name in :data:`NETWORKS`, or as ``module:Class``.

    Raises :class:`ValueError`, in one line, if there is no such class or it does not follow the protocol
    :class:`~esp_trainer.networks.protocol.Network`.
    """
    found = find_class("network", name, NETWORKS)
    respond.check(found, f"network {name}", calls=("genes", "memory"), fields=_FIELDS)
    return found


def make_network(name: str, n_hidden: int, n_actions: int) -> Any:
    """Return a network of a kind. Its ``n_genes`` is 0, as the length of its gene strings is not known yet."""
    kind, what = network_class(name), f"network {name}"
    n_memory = call_method(what, kind, "memory", n_hidden)
    _check_number(name, "memory", n_memory, 0)
    n_genes = call_method(what, kind, "genes", 2, n_actions, n_hidden)
    _check_number(name, "genes", n_genes, 1)
    try:
        return kind(n_hidden=n_hidden, n_genes=0, n_memory=n_memory, blank=(np.float32(0.0),) * n_actions)
    except Exception as error:
        raise ValueError(f"{what} cannot be made: {error_line(error)}") from None


def check_network(name: str, network: Any, n_inputs: int, n_together: int) -> None:
    """Raise :class:`ValueError`, in one line, unless a network's rule agrees with its declared sizes.

    Args:
        name: Name of its kind.
        network: The network.
        n_inputs: Number of its inputs, with the bias.
        n_together: Number of agents that it controls.
    """
    n_outputs = n_together * len(network.blank)
    n_genes = call_method(f"network {name}", network, "genes", n_inputs, n_outputs, network.n_hidden)
    _check_number(name, "genes", n_genes, 1)
    if name not in NETWORKS:
        _check_rule(name, network._replace(n_genes=int(n_genes)), n_inputs, n_outputs)


def _check_rule(name: str, network: Any, n_inputs: int, n_outputs: int) -> None:
    """Try the rule of a network, twice, and raise :class:`ValueError` unless it stays within its rows and outputs."""
    number = np.random.default_rng(0)
    weights, inputs = (Rows(lambda _: np.float32(number.normal())) for _ in range(2))
    memory, called = Rows(lambda _: np.int32(0)), f"the rule of network {name}"
    for _ in range(2):
        first = n_outputs - len(network.blank)
        done, outputs = try_rule(
            respond.registry[type(network)], network, weights, 0, inputs, n_inputs, first, memory, 0
        )
        weights.check(called, "weights, as genes() says", network.n_hidden * network.n_genes)
        inputs.check(called, "inputs, as n_inputs says", n_inputs)
        memory.check(called, "memory, as memory() says", network.n_memory)
        if not done:
            return
        if not isinstance(outputs, tuple) or len(outputs) != len(network.blank) or not np.isfinite(outputs).all():
            raise ValueError(f"{called} must return {len(network.blank)} finite outputs, got {brief(outputs)}")


def _check_number(name: str, call: str, got: Any, least: int) -> None:
    """Raise :class:`ValueError` unless a method of a network returned an integer of at least ``least``."""
    if isinstance(got, bool) or not isinstance(got, (int, np.integer)) or got < least:
        raise ValueError(f"{call}() of network {name} must return an integer of at least {least}, got {brief(got)}")
