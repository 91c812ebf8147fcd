"""From a side's settings to the networks of its agents."""

from __future__ import annotations

import numpy as np

from esp_trainer.config import SideConfig
from esp_trainer.types import Controller


def make_controller(side: SideConfig, wiring: np.ndarray, n_actions: int) -> Controller:
    """The controller of each agent of a side.

    Args:
        side: Its settings.
        wiring: Which entries of an observation each network reads, int ``(n_networks, n_inputs)``.
        n_actions: Actions to choose from.
    """
    if n_actions < 2 or wiring.ndim != 2 or wiring.shape[1] < 2:  # the forward pass starts with two
        raise ValueError(f"a controller needs 2 actions and 2 inputs a network, got {n_actions} and {wiring.shape}")
    if not np.issubdtype(wiring.dtype, np.integer) or wiring.min() < 0:
        raise ValueError(f"wiring must hold indices of an observation, got {wiring.dtype} from {wiring.min()} on")
    return Controller(
        n_networks=wiring.shape[0],
        n_inputs=wiring.shape[1],
        n_hidden=side.n_hidden,
        blank=(np.float32(0.0),) * n_actions,
        bias=side.bias,
        logistic_output=side.output == "logistic",
        skip_silent=side.captured_vote == "skip",
        input_scale=np.float32(side.input_scale),
        wiring=np.ascontiguousarray(wiring, np.int64),
    )


def offset_wiring(side: SideConfig, n_opponents: int) -> np.ndarray:
    """The wiring for observations that hold an (x, y) offset for each opponent: a network for each, or one for all."""
    pairs = np.arange(2 * n_opponents).reshape(n_opponents, 2)
    return pairs if side.controller == "split" else pairs.reshape(1, -1)
