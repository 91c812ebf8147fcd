"""Policies made by learning libraries, which choose for many agents at once."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np

from esp_trainer.arrays import ActionProbabilities
from esp_trainer.types import PolicyError
from predprey_env.arrays import Actions, Observation, Observations
from predprey_env.config import TeamShape
from predprey_env.settings import brief


class BatchedPolicy(ABC):
    """A policy without memory that treats all agents of its team alike.

    Implements the policy protocol, with ``act_batch`` for vector environments. A subclass implements :meth:`choose`,
    which returns an action for each row of observations.
    """

    def reset(self, seed: int | None = None) -> None:  # noqa: B027 - not abstract: most policies need none
        """Do nothing: the policy has no memory, and no randomness."""

    def act(self, observations: Observations) -> dict[str, int]:
        """Return an action for each agent that has an observation, float32 ``(n_seen,)``."""
        if not observations:
            return {}
        chosen = self.choose(np.stack(list(observations.values())))
        return dict(zip(observations, chosen.tolist(), strict=True))

    def act_batch(self, observations: Observation) -> Actions:
        """Return actions ``(n_worlds, n_agents)`` for observations float32 ``(n_worlds, n_agents, n_seen)``."""
        rows = observations.reshape(-1, observations.shape[-1])
        chosen = np.asarray(self.choose(rows))
        if chosen.shape != (len(rows),):
            raise ValueError(f"choose() must return {len(rows)} actions, got shape {chosen.shape}")
        return chosen.reshape(observations.shape[:-1])

    @abstractmethod
    def choose(self, rows: Observation) -> Actions:
        """Return actions, int ``(n,)``, for rows of observations, float32 ``(n, n_seen)``."""


class WeighingPolicy(BatchedPolicy):
    """A policy with action probabilities; acts greedily or samples.

    Args:
        shape: Shape of the team.
        drawn: True to sample actions; False to take the most likely ones.
    """

    def __init__(self, shape: TeamShape, *, drawn: bool) -> None:
        self._n_actions = shape.n_actions
        self.drawn = drawn

    def chances_batch(self, observations: Observation) -> ActionProbabilities:
        """Return the probabilities of all actions, float64 ``(n_worlds, n_agents, n_actions)``.

        The observations are float32 ``(n_worlds, n_agents, n_seen)``. Raises :class:`ValueError` if the policy gives no
        probabilities.
        """
        found = self.weigh(observations.reshape(-1, observations.shape[-1]))
        return found.astype(np.float64).reshape(*observations.shape[:-1], self._n_actions)

    @abstractmethod
    def weigh(self, rows: Observation) -> ActionProbabilities:
        """Return the probabilities of all actions, ``(n, n_actions)``, for rows of observations."""


class SB3Policy(WeighingPolicy):
    """A model of Stable-Baselines3.

    Args:
        model: Model with the spaces of one agent of the team; other spaces raise :class:`ValueError`.
        shape: Shape of the team.
        drawn: True to sample actions from the model's probabilities; False to take its most likely ones.
    """

    def __init__(self, model: Any, shape: TeamShape, *, drawn: bool = False) -> None:
        seen, n_actions = model.observation_space.shape, getattr(model.action_space, "n", None)
        if seen != (shape.n_seen,) or n_actions != shape.n_actions:
            raise ValueError(
                f"the model must observe {shape.n_seen} numbers and have {shape.n_actions} actions, "
                f"got {brief(model.observation_space)} and {brief(model.action_space)}"
            )
        super().__init__(shape, drawn=drawn)
        self._model = model

    def reset(self, seed: int | None = None) -> None:
        """Set the libraries' own random generators to the seed, which determines the sampled actions."""
        if self.drawn:
            self._model.set_random_seed(seed)

    def choose(self, rows: Observation) -> Actions:
        """Return the actions that the model predicts."""
        return np.asarray(self._model.predict(rows, deterministic=not self.drawn)[0])

    def weigh(self, rows: Observation) -> ActionProbabilities:
        """Return the probabilities of a model that has a distribution over actions, such as PPO and A2C."""
        policy = self._model.policy
        if not hasattr(policy, "get_distribution"):
            raise PolicyError(f"{type(self._model).__name__} does not give the probabilities of its actions")
        import torch

        with torch.no_grad():
            return policy.get_distribution(policy.obs_to_tensor(rows)[0]).distribution.probs.cpu().numpy()


class TorchPolicy(WeighingPolicy):
    """A PyTorch module.

    Args:
        module: Module that maps observations float32 ``(n, n_seen)`` to logits ``(n, n_actions)`` or to actions, int
            ``(n,)``; or a TensorDict module, such as TorchRL's actors, that reads ``"observation"`` and writes
            ``"action"``.
        shape: Shape of the team.
        drawn: True to sample actions from the probabilities; False to take the most likely ones.
    """

    def __init__(self, module: Any, shape: TeamShape, *, drawn: bool = False) -> None:
        super().__init__(shape, drawn=drawn)
        self._module = module.eval()
        self._reads_dictionaries = hasattr(module, "in_keys") and hasattr(module, "out_keys")

    def reset(self, seed: int | None = None) -> None:
        """Set PyTorch's own random generator to the seed, which determines the sampled actions."""
        if self.drawn and seed is not None:
            import torch

            torch.manual_seed(seed)

    def choose(self, rows: Observation) -> Actions:
        """Return the module's actions. Raises :class:`ValueError` unless its output is logits or actions."""
        import torch

        found = self._ask(rows)
        if found.ndim == 1:
            return found.numpy()
        chosen = torch.multinomial(found.softmax(1), 1)[:, 0] if self.drawn else found.argmax(1)
        return chosen.numpy()

    def weigh(self, rows: Observation) -> ActionProbabilities:
        """Return the softmax of the module's logits."""
        found = self._ask(rows)
        if found.ndim == 1:
            raise PolicyError("the module does not give the probabilities of its actions: it returns actions")
        return found.softmax(1).numpy()

    def _ask(self, rows: Observation) -> Any:
        """Return the module's output, checked: logits, or actions."""
        import torch

        with torch.no_grad():
            found = self._forward(torch.from_numpy(rows)).cpu()
        if found.ndim == 1 and not found.is_floating_point():
            return found
        if tuple(found.shape) != (len(rows), self._n_actions):
            expected = f"({len(rows)}, {self._n_actions}) logits or ({len(rows)},) integer actions"
            raise ValueError(f"the module must return {expected}, got {found.dtype} of shape {tuple(found.shape)}")
        if found.isnan().any():
            raise ValueError("the module must return numbers, got NaN")
        return found

    def _forward(self, rows: Any) -> Any:
        if not self._reads_dictionaries:
            return self._module(rows)
        from tensordict import TensorDict
        from tensordict.nn import InteractionType, set_interaction_type

        with set_interaction_type(InteractionType.RANDOM if self.drawn else InteractionType.DETERMINISTIC):
            action = self._module(TensorDict({"observation": rows}, batch_size=[len(rows)]))["action"]
        one_hot = action.ndim == 2 and action.shape[1] == self._n_actions
        return action.argmax(dim=1) if one_hot else action.reshape(len(rows))
