"""Controllers: the networks of a side's agents, built from its settings."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from esp_trainer.config import SideConfig
from esp_trainer.networks.controller import Controller
from esp_trainer.networks.registry import check_network, make_network
from predprey_env.sight import PLAIN_SIGHT, AnySight


def make_controller(
    side: SideConfig, wiring: np.ndarray, n_actions: int, n_agents: int = 1, sight: AnySight = PLAIN_SIGHT
) -> Controller:
    """Return the controller of each agent of a side, or of all its agents if it is central.

    Args:
        side: Settings of the side.
        wiring: Indices of the observation entries that each network reads, int ``(n_networks, n_inputs)``.
        n_actions: Number of actions.
        n_agents: Number of agents of the side.
        sight: What the agents observe.
    """
    if n_actions < 2 or wiring.ndim != 2 or wiring.shape[1] < 2:  # the forward pass unrolls the first two
        raise ValueError(f"a controller needs 2 actions and 2 inputs a network, got {n_actions} and {wiring.shape}")
    if not np.issubdtype(wiring.dtype, np.integer) or wiring.min() < 0:
        raise ValueError(f"wiring must hold indices of an observation, got {wiring.dtype} from {wiring.min()} on")
    controller = Controller(
        n_networks=wiring.shape[0],
        n_inputs=wiring.shape[1],
        network=make_network(side.network, side.n_hidden, n_actions),
        bias=side.bias,
        logistic_output=side.output == "logistic",
        draws=side.choice == "drawn",
        skip_silent=side.captured_vote == "skip",
        input_scale=np.float32(side.input_scale),
        combines=side.controller == "combiner",
        n_together=n_agents if side.controller == "central" else 1,
        sight=sight,
        wiring=np.ascontiguousarray(wiring, np.int64),
    )
    for n_inputs in {n + int(side.bias) for n in controller.fan_in}:
        check_network(side.network, controller.network, n_inputs, controller.n_together)
    return controller._replace(network=controller.network._replace(n_genes=max(controller.used_genes)))


def wiring_for(side: SideConfig, n_opponents: int, n_agents: int = 1, sight: AnySight = PLAIN_SIGHT) -> np.ndarray:
    """Return the entries of an observation that each network reads, int ``(n_networks, n_inputs)``.

    A split controller has a network for each group of entries of the sight. In the paper's observation each group
    describes one other agent; a team-mate that is seen has a group as an opponent does. Only a central controller reads
    entries that are in no group, such as indices of agents, since all others have networks for each agent. It reads the
    observations of all ``n_agents``, one after the other.
    """
    if side.controller == "central":
        return np.arange(n_agents * sight.n_seen(n_agents, n_opponents)).reshape(1, -1)
    entries = sight.groups(n_agents, n_opponents)
    groups = TOPOLOGIES[side.controller](len(entries))
    return np.array([sorted(entry for each in group for entry in entries[each]) for group in groups])


def _each(n_groups: int) -> list[tuple[int, ...]]:
    return [(group,) for group in range(n_groups)]


def _all(n_groups: int) -> list[tuple[int, ...]]:
    return [tuple(range(n_groups))]


def _pairs(n_groups: int) -> list[tuple[int, ...]]:
    return list(combinations(range(n_groups), min(2, n_groups)))


TOPOLOGIES = {
    "split": _each,
    "combiner": _each,
    "double": lambda n_groups: 2 * _each(n_groups),
    "pairs": _pairs,
    "monolithic": _all,
}
"""Name of a controller -> function that maps the number of groups to the groups that each of its networks reads."""
