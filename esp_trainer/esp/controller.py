"""From a side's settings to the networks of its agents."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from esp_trainer.config import SideConfig
from esp_trainer.types import Controller


def make_controller(side: SideConfig, wiring: np.ndarray, n_actions: int, n_agents: int = 1) -> Controller:
    """The controller of each agent of a side, or of all of them where it is central.

    Args:
        side: Its settings.
        wiring: Which entries of an observation each network reads, int ``(n_networks, n_inputs)``.
        n_actions: Actions to choose from.
        n_agents: Agents of the side.
    """
    if n_actions < 2 or wiring.ndim != 2 or wiring.shape[1] < 2:  # the forward pass starts with two
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
    """The wiring for observations that hold an (x, y) offset for each opponent.

    A central controller reads those of all ``n_agents``, one after the other.
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
"""Which opponents each network of an agent's controller sees."""
