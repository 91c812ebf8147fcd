"""The settings of a training by ``train_ppo.py``, and the worlds in which its agents play."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from esp_trainer import Team
from esp_trainer.tasks import WORLDS
from predprey_env import EnvConfig, vector_env


@dataclass
class PPOSettings:
    """Settings of training."""

    role: str
    task: str = "3v2"
    size: int = 100
    """Size of the torus in cells; an episode has one and a half times as many steps."""
    opponents: tuple[str, ...] = ()
    reward: str = "dense"
    seed: int = 0
    steps: int = 20_000_000
    """Steps of agents, in all."""
    n_hidden: int = 64
    n_worlds: int = 8
    """For each opponent."""
    horizon: int = 150
    epochs: int = 4
    minibatches: int = 8
    learning_rate: float = 1e-3
    gamma: float = 0.995
    trace: float = 0.95
    clip: float = 0.2
    entropy: float = 0.005
    n_checkpoints: int = 10

    @property
    def env(self) -> EnvConfig:
        """The world, whatever it rewards."""
        return WORLDS[self.task].replace(size=self.size, max_cycles=self.size * 3 // 2)


class TrainingWorlds:
    """Vector environments with an opponent each, as one batch: everything is ``(n_worlds, n_agents, ...)``."""

    def __init__(self, settings: PPOSettings, role: str, opponents: list[str | Team]) -> None:
        self.settings, self.role = settings, role
        self.shape = settings.env.team(role)
        self._n_begun = 0
        self.envs = [self._env(opponent) for opponent in opponents]
        self.parts = [self._begin(i) for i in range(len(opponents))]
        self.captures: list[float] = []
        """Fraction of prey caught in each episode that ended."""

    def _env(self, opponent: str | Team) -> Any:
        env = self.settings.env.replace(reward=self.settings.reward)
        return vector_env(self.settings.n_worlds, self.role, opponent, "SameStep", **env.model_dump())

    def _begin(self, i: int) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        seed = (1 + self.settings.seed) * 1_000_003 + self._n_begun * self.settings.n_worlds
        self._n_begun += 1
        return self.envs[i].reset(seed=seed)

    def replace(self, i: int, opponent: str | Team) -> None:
        """Let one of the environments start again with another opponent."""
        self.envs[i] = self._env(opponent)
        self.parts[i] = self._begin(i)

    def look(self) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Return what agents see, the fraction of the time that has passed, and who still plays."""
        seen = np.stack([part[0] for part in self.parts]).reshape(-1, self.shape.n_agents, self.shape.n_seen)
        steps, captured = (np.stack([part[1][name] for part in self.parts]) for name in ("steps", "captured"))
        passed = steps.reshape(-1, self.shape.n_agents)[:, 0] / self.settings.env.max_cycles
        playing = captured.reshape(-1, self.shape.n_agents) == 0
        return torch.from_numpy(seen), torch.from_numpy(passed).float(), torch.from_numpy(playing).float()

    def step(self, actions: np.ndarray) -> tuple[torch.Tensor, torch.Tensor]:
        """Return rewards in [0, 1] over an episode, and which worlds ended."""
        rewards, ends = [], []
        for i, (env, chosen) in enumerate(zip(self.envs, np.split(actions, len(self.envs)), strict=True)):
            seen, reward, terminated, truncated, infos = env.step(chosen.ravel())
            self.parts[i] = seen, infos
            rewards.append(reward.reshape(chosen.shape) / 25)
            ends.append((terminated | truncated).reshape(chosen.shape)[:, 0])
            if ends[-1].any():
                caught = infos["final_info"]["n_captured"].reshape(chosen.shape)[ends[-1], 0]
                self.captures += (caught / env.config.n_prey).tolist()
        return torch.from_numpy(np.concatenate(rewards)).float(), torch.from_numpy(np.concatenate(ends)).float()
