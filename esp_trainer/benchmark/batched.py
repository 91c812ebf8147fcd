"""What learning libraries give us: policies that are asked about many agents at once."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np

from predprey_env.actions import brief
from predprey_env.config import TeamShape


class BatchedPolicy(ABC):
    """A policy that remembers nothing and plays every agent of its team alike.

    Meets the policy protocol, with ``act_batch`` for vector environments; what it is asked for is an action for each
    row of observations.
    """

    def reset(self, seed: int | None = None) -> None:  # noqa: B027 - not abstract: most need none
        """Nothing to forget, and nothing random."""

    def act(self, observations: dict[str, np.ndarray]) -> dict[str, int]:
        """An action for each agent that has an observation, float32 ``(n_seen,)``."""
        if not observations:
            return {}
        chosen = self.choose(np.stack(list(observations.values())))
        return dict(zip(observations, chosen.tolist(), strict=True))

    def act_batch(self, observations: np.ndarray) -> np.ndarray:
        """Actions ``(n_worlds, n_agents)`` for observations float32 ``(n_worlds, n_agents, n_seen)``."""
        return self.choose(observations.reshape(-1, observations.shape[-1])).reshape(observations.shape[:-1])

    @abstractmethod
    def choose(self, rows: np.ndarray) -> np.ndarray:
        """Actions, int ``(n,)``, for rows of observations, float32 ``(n, n_seen)``."""


class SB3Policy(BatchedPolicy):
    """A model of Stable-Baselines3.

    Args:
        model: Its spaces must be those of one agent of the team, or it is a :class:`ValueError`.
        shape: Of the team.
        drawn: Whether actions are drawn from the model's chances; else they are its most likely ones.
    """

    def __init__(self, model: Any, shape: TeamShape, *, drawn: bool = False) -> None:
        seen, n_actions = model.observation_space.shape, getattr(model.action_space, "n", None)
        if seen != (shape.n_seen,) or n_actions != shape.n_actions:
            raise ValueError(
                f"the model must observe {shape.n_seen} numbers and have {shape.n_actions} actions, "
                f"got {brief(model.observation_space)} and {brief(model.action_space)}"
            )
        self._model = model
        self._drawn = drawn

    def reset(self, seed: int | None = None) -> None:
        """What is drawn follows from the seed; the libraries' own generators are set to it."""
        if self._drawn:
            self._model.set_random_seed(seed)

    def choose(self, rows: np.ndarray) -> np.ndarray:
        """What the model predicts."""
        return np.asarray(self._model.predict(rows, deterministic=not self._drawn)[0])


class TorchPolicy(BatchedPolicy):
    """A PyTorch module.

    Args:
        module: From observations float32 ``(n, n_seen)`` to logarithms of chances ``(n, n_actions)``, up to a constant,
            or to actions, int ``(n,)``; or a TensorDict module, such as TorchRL's actors, that reads ``"observation"``
            and writes ``"action"``.
        shape: Of the team.
        drawn: Whether actions are drawn from the chances; else they are the most likely ones.
    """

    def __init__(self, module: Any, shape: TeamShape, *, drawn: bool = False) -> None:
        self._module = module.eval()
        self._drawn = drawn
        self._n_actions = shape.n_actions
        self._reads_dictionaries = hasattr(module, "in_keys") and hasattr(module, "out_keys")

    def reset(self, seed: int | None = None) -> None:
        """What is drawn follows from the seed; PyTorch's own generator is set to it."""
        if self._drawn and seed is not None:
            import torch

            torch.manual_seed(seed)

    def choose(self, rows: np.ndarray) -> np.ndarray:
        """What the module prefers; :class:`ValueError` for an output that is neither preferences nor actions."""
        import torch

        with torch.no_grad():
            found = self._forward(torch.from_numpy(rows)).cpu()
        if found.ndim == 1 and not found.is_floating_point():
            return np.asarray(found.numpy())
        if tuple(found.shape) != (len(rows), self._n_actions):
            expected = f"({len(rows)}, {self._n_actions}) preferences or ({len(rows)},) integer actions"
            raise ValueError(f"the module must return {expected}, got {found.dtype} of shape {tuple(found.shape)}")
        if found.isnan().any():
            raise ValueError("the module must return numbers, got NaN")
        chosen = torch.multinomial(found.softmax(1), 1)[:, 0] if self._drawn else found.argmax(1)
        return np.asarray(chosen.numpy())

    def _forward(self, rows: Any) -> Any:
        if not self._reads_dictionaries:
            return self._module(rows)
        from tensordict import TensorDict
        from tensordict.nn import InteractionType, set_interaction_type

        with set_interaction_type(InteractionType.RANDOM if self._drawn else InteractionType.DETERMINISTIC):
            action = self._module(TensorDict({"observation": rows}, batch_size=[len(rows)]))["action"]
        one_hot = action.ndim == 2 and action.shape[1] == self._n_actions
        return action.argmax(dim=1) if one_hot else action.reshape(len(rows))
