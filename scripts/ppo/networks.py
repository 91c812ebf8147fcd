"""The networks of ``train_ppo.py``: a policy that can be saved as a team, and a critic."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from torch import nn

from esp_trainer import Team
from esp_trainer.config import SideConfig
from esp_trainer.esp.controller import make_controller, wiring_for
from predprey_env import EnvConfig

INPUT_SCALE = 0.2
"""Factor on the offsets, in 1/cells: a step beside an opponent must show."""
ALWAYS_ON = 40.0
"""Bias gene of a hidden neuron that is 1 whatever it sees."""


class Actor(nn.Module):
    """Preferences for each action; agents differ by a bias of their own in every hidden neuron."""

    def __init__(self, n_seen: int, n_agents: int, n_actions: int, n_hidden: int) -> None:
        super().__init__()
        self.see = nn.Linear(n_seen, n_hidden, bias=False)
        self.know = nn.Parameter(torch.zeros(n_agents, n_hidden))
        self.act = nn.Linear(n_hidden, n_actions)
        nn.init.orthogonal_(self.act.weight, 0.01)

    def forward(self, seen: torch.Tensor) -> torch.Tensor:
        """From ``(..., n_agents, n_seen)`` to ``(..., n_agents, n_actions)``."""
        return self.act(torch.tanh(self.see(seen * INPUT_SCALE) + self.know))

    def as_team(self, role: str, env: EnvConfig, provenance: dict[str, Any]) -> Team:
        """Return the same as a team of networks with logistic neurons.

        ``tanh(x) = 2 / (1 + exp(-2 x)) - 1``, and what that takes off is given back by one neuron that is always on.
        """
        n_agents, n_opponents, n_actions, _ = env.team(role)
        see, out, offset = (p.detach().numpy() for p in (self.see.weight, self.act.weight, self.act.bias))
        side = SideConfig(
            controller="monolithic",
            n_hidden=len(see) + 1,
            bias=True,
            output="linear",
            choice="drawn",
            input_scale=INPUT_SCALE,
        )
        genomes = np.zeros((n_agents, 1, len(see) + 1, see.shape[1] + 1 + n_actions), np.float32)
        for genome, know in zip(genomes[:, 0], self.know.detach().numpy(), strict=True):
            genome[:-1] = np.concatenate([2 * see, 2 * know[:, None], 2 * out.T], axis=1)
            genome[-1, see.shape[1] :] = np.concatenate([[ALWAYS_ON], offset - out.sum(axis=1)])
        controller = make_controller(side, wiring_for(side, n_opponents), n_actions)
        origin = {"preset": "ppo", "env": env.model_dump(), **provenance}
        return Team(role, side, controller, genomes, origin, controller.n_seen)


class Critic(nn.Module):
    """The return to come, for each agent, from what the whole team sees and the time that is left."""

    def __init__(self, n_seen: int, n_agents: int, n_hidden: int = 64) -> None:
        super().__init__()
        n_in = n_agents * n_seen + 1
        self.net = nn.Sequential(nn.Linear(n_in, n_hidden), nn.Tanh(), nn.Linear(n_hidden, n_hidden), nn.Tanh())
        self.value = nn.Linear(n_hidden, n_agents)

    def forward(self, seen: torch.Tensor, passed: torch.Tensor) -> torch.Tensor:
        """From ``(..., n_agents, n_seen)`` and ``(...)`` to ``(..., n_agents)``."""
        return self.value(self.net(torch.cat([seen.flatten(-2) * INPUT_SCALE, passed[..., None]], -1)))
