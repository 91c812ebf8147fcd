"""Controllers: the networks of a side's agents, built from its settings."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from esp_trainer.config import SideConfig
from esp_trainer.types import Controller


def make_controller(side: SideConfig, wiring: np.ndarray, n_actions: int, n_agents: int = 1) -> Controller:
    """Return the controller of each agent of a side, or of all its agents if it is central.

    Args:
        side: Settings of the side.
        wiring: Indices of the observation entries that each network reads, int ``(n_networks, n_inputs)``.
        n_actions: Number of actions.
        n_agents: Number of agents of the side.
    """
    if n_actions < 2 or wiring.ndim != 2 or wiring.shape[1] < 2:  # the forward pass unrolls the first two
        raise ValueError(f"a controller needs 2 actions and 2 inputs a network, got {n_actions} and {wiring.shape}")
    if not np.issubdtype(wiring.dtype, np.integer) or wiring.min() < 0:
        raise ValueError(f"wiring must hold indices of an observation, got {wiring.dtype} from {wiring.min()} on")
    controller = Controller(
        n_networks=wiring.shape[0],
        n_inputs=wiring.shape[1],
        n_hidden=side.n_hidden,
        blank=(np.float32(0.0),) * n_actions,
        bias=side.bias,
        logistic_output=side.output == "logistic",
        draws=side.choice == "drawn",
        skip_silent=side.captured_vote == "skip",
        input_scale=np.float32(side.input_scale),
        combines=side.controller == "combiner",
        n_together=n_agents if side.controller == "central" else 1,
        n_genes=0,
        wiring=np.ascontiguousarray(wiring, np.int64),
    )
    return controller._replace(n_genes=max(controller.used_genes))


def offset_wiring(side: SideConfig, n_opponents: int, n_agents: int = 1) -> np.ndarray:
    """Return the wiring for observations that hold an (x, y) offset for each opponent.

    A central controller reads the observations of all ``n_agents``, one after the other.
    """
    if side.controller == "central":
        return np.arange(2 * n_opponents * n_agents).reshape(1, -1)
    groups = TOPOLOGIES[side.controller](n_opponents)
    return np.array([[2 * opponent + axis for opponent in group for axis in (0, 1)] for group in groups])


def _each(n_opponents: int) -> list[tuple[int, ...]]:
    return [(opponent,) for opponent in range(n_opponents)]


def _all(n_opponents: int) -> list[tuple[int, ...]]:
    return [tuple(range(n_opponents))]


def _pairs(n_opponents: int) -> list[tuple[int, ...]]:
    return list(combinations(range(n_opponents), min(2, n_opponents)))


TOPOLOGIES = {
    "split": _each,
    "combiner": _each,
    "double": lambda n_opponents: 2 * _each(n_opponents),
    "pairs": _pairs,
    "monolithic": _all,
}
"""Name of a controller -> function from the number of opponents to the opponents that each of its networks sees."""
