"""MPE's simple_tag, with many episodes side by side in NumPy: the same numbers as those of ``mpe2``, to the bit.

The game is from Lowe et al., Multi-agent actor-critic for mixed cooperative-competitive environments, NeurIPS 2017. The
environment is that of ``mpe2``; :class:`ManyTag` adds what :class:`esp_trainer.game.ManyEpisodes` asks for. Its
arithmetic follows ``mpe2`` operation by operation, because floating-point sums depend on their order.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium.utils import seeding
from mpe2 import simple_tag_v3

from esp_trainer.arrays import BoolMask
from predprey_env.arrays import Actions, Observation, Seeds

_MOVES = np.array([[0.0, 0.0], [-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]])
_STEP, _DAMPING, _CONTACT, _MARGIN = 0.1, 0.25, 1e2, 1e-3
_ADVERSARY, _AGENT, _OBSTACLE = 0.075, 0.05, 0.2  # radii


def parallel_env(
    num_good: int = 1, num_adversaries: int = 3, num_obstacles: int = 2, max_cycles: int = 25
) -> Any:  # an environment of mpe2, which is not typed
    """Return ``mpe2.simple_tag_v3.parallel_env(...)`` with a method ``many()``."""
    env = simple_tag_v3.parallel_env(
        num_good=num_good, num_adversaries=num_adversaries, num_obstacles=num_obstacles, max_cycles=max_cycles
    )
    env.many = lambda: ManyTag(num_good, num_adversaries, num_obstacles, max_cycles)
    return env


class ManyTag:
    """Episodes of adversaries that chase agents among obstacles.

    Args:
        num_good: Number of agents.
        num_adversaries: Number of adversaries.
        num_obstacles: Number of obstacles.
        max_cycles: Length of an episode, in steps.
    """

    def __init__(self, num_good: int, num_adversaries: int, num_obstacles: int, max_cycles: int) -> None:
        self._n_adversaries, self._n_movers, self._max_cycles = num_adversaries, num_adversaries + num_good, max_cycles
        self._names = [f"adversary_{i}" for i in range(num_adversaries)] + [f"agent_{i}" for i in range(num_good)]
        self._radii = [_ADVERSARY] * num_adversaries + [_AGENT] * num_good + [_OBSTACLE] * num_obstacles
        self._accelerations = [3.0] * num_adversaries + [4.0] * num_good
        self._most = [1.0] * num_adversaries + [1.3] * num_good  # speeds

    def reset(self, seeds: Seeds) -> dict[str, Observation]:
        """Begin an episode for each seed."""
        n_all = len(self._radii)
        self._steps, self._at = 0, np.empty((n_all, len(seeds), 2))
        for world, seed in enumerate(seeds.tolist()):
            generator, _ = seeding.np_random(seed)
            for entity in range(n_all):
                reach = 1 if entity < self._n_movers else 0.9
                self._at[entity, world] = generator.uniform(-reach, reach, 2)
        self._speed = np.zeros((self._n_movers, len(seeds), 2))
        return self._seen()

    def step(self, actions: Mapping[str, Actions]) -> tuple[dict[str, Observation], dict[str, np.ndarray], BoolMask]:
        """Take a step in all episodes."""
        for i, force in enumerate(self._forces(actions)):
            self._at[i] += self._speed[i] * _STEP
            speed = self._speed[i] * (1 - _DAMPING)
            speed += force * _STEP
            size = _length(speed)
            with np.errstate(divide="ignore", invalid="ignore"):
                slowed = speed / size[:, None] * self._most[i]
            self._speed[i] = np.where(size[:, None] > self._most[i], slowed, speed)
        self._steps += 1
        return self._seen(), self._rewards(), np.full(self._at.shape[1], self._steps >= self._max_cycles)

    def _forces(self, actions: Mapping[str, Actions]) -> list[np.ndarray]:
        """Return the force on each mover: its own, and the pushes of all entities that it touches."""
        forces = [_MOVES[actions[name]] * self._accelerations[i] for i, name in enumerate(self._names)]
        for a in range(self._n_movers):
            for b in range(a + 1, len(self._radii)):
                apart = self._at[a] - self._at[b]
                distance = _length(apart)
                depth = np.logaddexp(0, -(distance - (self._radii[a] + self._radii[b])) / _MARGIN) * _MARGIN
                push = _CONTACT * apart / distance[:, None] * depth[:, None]
                forces[a] = push + forces[a]
                if b < self._n_movers:
                    forces[b] = -push + forces[b]
        return forces

    def _seen(self) -> dict[str, Observation]:
        """Return each mover's observation.

        It holds the mover's own speed and place, the offsets of obstacles and other movers, and the speeds of the other
        agents.
        """
        movers, obstacles = range(self._n_movers), range(self._n_movers, len(self._radii))
        seen = {}
        for i, name in enumerate(self._names):
            others = [j for j in movers if j != i]
            away = [self._at[j] - self._at[i] for j in (*obstacles, *others)]
            speeds = [self._speed[j] for j in others if j >= self._n_adversaries]
            seen[name] = np.concatenate([self._speed[i], self._at[i], *away, *speeds], axis=1).astype(np.float32)
        return seen

    def _rewards(self) -> dict[str, np.ndarray]:
        """Return the rewards.

        Each touch pays 10 to all adversaries and -10 to the agent. It also pays for coordinates beyond 0.9 or -0.9.
        """
        rewards, touches = {}, np.zeros(self._at.shape[1])
        for agent in range(self._n_adversaries, self._n_movers):
            own = np.zeros(self._at.shape[1])
            for adversary in range(self._n_adversaries):
                apart = _length(self._at[agent] - self._at[adversary])
                own += apart < self._radii[agent] + self._radii[adversary]
            touches += own
            paid = -10.0 * own
            for axis in (0, 1):
                x = np.abs(self._at[agent][:, axis])
                outside = np.minimum(np.exp(2 * x - 2), 10)
                paid = paid - np.where(x < 0.9, 0.0, np.where(x < 1.0, (x - 0.9) * 10, outside))
            rewards[self._names[agent]] = paid
        return {**dict.fromkeys(self._names[: self._n_adversaries], 10.0 * touches), **rewards}


def _length(vectors: np.ndarray) -> np.ndarray:
    squares = np.square(vectors)
    lengths: np.ndarray = np.sqrt(squares[:, 0] + squares[:, 1])
    return lengths
