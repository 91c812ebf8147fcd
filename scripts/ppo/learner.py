"""Proximal policy optimisation of one team (Schulman et al. 2017)."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import torch
from torch import nn

from esp_trainer import Team
from ppo.networks import Actor, Critic
from ppo.worlds import PPOSettings, TrainingWorlds


class Batch(NamedTuple):
    """Observations and actions of a rollout: the first axes are time and world, or just rows of both."""

    seen: torch.Tensor
    passed: torch.Tensor
    playing: torch.Tensor
    """Whether an agent still is in the game, for each agent."""
    actions: torch.Tensor
    chances: torch.Tensor
    """Logarithms of the chances that the actions had."""
    values: torch.Tensor
    rewards: torch.Tensor
    ends: torch.Tensor
    """Whether the episode ended with the step, for each world."""


LOSSES = ("policy", "value", "entropy")


class Learner:
    """One team's policy and critic, in its worlds."""

    def __init__(self, settings: PPOSettings, role: str, opponents: list[str | Team]) -> None:
        self.settings, self.role = settings, role
        self.worlds = TrainingWorlds(settings, role, opponents)
        shape = self.worlds.shape
        self.policy = Actor(shape.n_seen, shape.n_agents, shape.n_actions, settings.n_hidden)
        self.critic = Critic(shape.n_seen, shape.n_agents)
        self.parameters = [*self.policy.parameters(), *self.critic.parameters()]
        self.optimiser = torch.optim.Adam(self.parameters, settings.learning_rate, eps=1e-5)
        self.steps = 0

    def update(self, left: float) -> dict[str, float]:
        """Play, and learn from it; ``left`` of the training, from 1 to 0, scales the learning rate."""
        self.optimiser.param_groups[0]["lr"] = left * self.settings.learning_rate
        batch, last = self._play()
        advantages = self._advantages(batch, last)
        losses = self._learn(batch, advantages)
        captures, self.worlds.captures = self.worlds.captures, []
        return {"caught": float(np.mean(captures)) if captures else float("nan"), **losses}

    def team(self, **provenance: Any) -> Team:
        """Return the policy as it is, as a team."""
        return self.policy.as_team(self.role, self.settings.env, provenance)

    @torch.no_grad()
    def _play(self) -> tuple[Batch, torch.Tensor]:
        """Return what was seen and done, ``(horizon, n_worlds, ...)`` each, and the values of where it led to."""
        moments = []
        for _ in range(self.settings.horizon):
            seen, passed, playing = self.worlds.look()
            preferences = torch.log_softmax(self.policy(seen), -1)
            actions = torch.multinomial(preferences.exp().flatten(0, 1), 1).view(seen.shape[:2])
            chances = preferences.gather(-1, actions[..., None])[..., 0]
            values = self.critic(seen, passed)
            rewards, ends = self.worlds.step(actions.numpy())
            moments.append((seen, passed, playing, actions, chances, values, rewards, ends))
        self.steps += self.settings.horizon * actions.numel()
        seen, passed, _ = self.worlds.look()
        return Batch(*map(torch.stack, zip(*moments, strict=True))), self.critic(seen, passed)

    def _advantages(self, batch: Batch, last: torch.Tensor) -> torch.Tensor:
        """Return generalised advantages; nothing is expected after the end of the time, which ends the game."""
        gamma, trace = self.settings.gamma, self.settings.trace
        advantages, following = torch.empty_like(batch.rewards), last
        running = torch.zeros_like(last)
        for t in reversed(range(len(advantages))):
            goes_on = 1 - batch.ends[t][:, None]
            surprise = batch.rewards[t] + gamma * goes_on * following - batch.values[t]
            advantages[t] = running = surprise + gamma * trace * goes_on * running
            following = batch.values[t]
        return advantages

    def _learn(self, batch: Batch, advantages: torch.Tensor) -> dict[str, float]:
        flat, advantages = Batch(*(each.flatten(0, 1) for each in batch)), advantages.flatten(0, 1)
        returns, found = advantages + flat.values, []
        for _ in range(self.settings.epochs):
            for rows in torch.randperm(len(returns)).chunk(self.settings.minibatches):
                losses = self._losses(Batch(*(each[rows] for each in flat)), advantages[rows], returns[rows])
                self.optimiser.zero_grad()
                losses.sum().backward()
                nn.utils.clip_grad_norm_(self.parameters, 0.5)
                self.optimiser.step()
                found.append(losses.detach())
        return dict(zip(LOSSES, torch.stack(found).mean(dim=0).tolist(), strict=True))

    def _losses(self, batch: Batch, advantages: torch.Tensor, returns: torch.Tensor) -> torch.Tensor:
        """Return each of :data:`LOSSES`."""
        share = batch.playing / batch.playing.sum().clamp(min=1)  # caught prey choose nothing
        mean = (advantages * share).sum()
        advantages = (advantages - mean) / (((advantages - mean) ** 2 * share).sum() + 1e-8).sqrt()
        preferences = torch.log_softmax(self.policy(batch.seen), -1)
        ratio = (preferences.gather(-1, batch.actions[..., None])[..., 0] - batch.chances).exp()
        clipped = ratio.clamp(1 - self.settings.clip, 1 + self.settings.clip)
        gain = torch.minimum(ratio * advantages, clipped * advantages)
        entropy = -(preferences.exp() * preferences).sum(-1)
        error = (self.critic(batch.seen, batch.passed) - returns) ** 2
        each = torch.stack([-gain, 0.5 * error, -self.settings.entropy * entropy])
        return (each * share).sum(dim=(1, 2))
