"""The vector environment as a Stable-Baselines3 ``VecEnv``; needs ``stable-baselines3``."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Sequence
from typing import Any, TypeAlias

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnv

from predprey_env.arrays import Actions, Observation, Picture, Rewards, RowMask
from predprey_env.envs.fixed import read_only
from predprey_env.envs.options import Options, read_reset_options
from predprey_env.envs.vector import PredPreyVectorEnv, vector_env
from predprey_env.policies.pool import Opponents
from predprey_env.policies.protocol import Policy
from predprey_env.settings import brief, whole_number

RowIndices: TypeAlias = int | Iterable[int] | None
"""Rows of a ``VecEnv``; None for all."""


class SB3VecEnv(VecEnv):
    """A :class:`~predprey_env.PredPreyVectorEnv` as a ``VecEnv``: one row for each agent, one policy for all of them.

    It sets the environment's ``autoreset_mode`` to ``AutoresetMode.SAME_STEP``, because Stable-Baselines3 expects a
    world to start again in the step in which it ends. Raises :class:`ValueError` if the environment has another mode
    and was already reset, or is inside a Gymnasium wrapper, which may have read the mode.

    Args:
        env: A vector environment, or the name of a task (:data:`predprey_env.TASKS`) from which to make one:
            ``SB3VecEnv("pond", num_envs=64)``.
        pictured_worlds: Number of worlds that videos show, if the environment has ``render_mode="rgb_array"``.
        making: Arguments of :func:`predprey_env.vector_env`, such as ``num_envs``, ``team`` and ``opponent``; only with
            the name of a task.
    """

    opponent: Policy | tuple[Policy, ...] = read_only("opponent", "call set_opponent(opponent)", "_worlds.opponent")
    """Policy that plays the other team, or all policies of a pool."""

    def __init__(
        self, env: VectorEnv[Observation, Actions, Rewards] | str, pictured_worlds: int = 1, **making: Any
    ) -> None:
        self._pictured_worlds = whole_number("pictured_worlds", pictured_worlds, 1)
        if isinstance(env, str):
            env = vector_env(task=env, **making)
        elif making:
            raise ValueError(f"{', '.join(making)} can be given only with the name of a task, not with an environment")
        worlds = getattr(env, "unwrapped", None)
        if not isinstance(worlds, PredPreyVectorEnv):
            raise ValueError(f"env must be a vector environment: call vector_env(...), got {type(env).__name__}")
        if env is worlds:
            worlds.autoreset_mode = AutoresetMode.SAME_STEP
        self.env, self._worlds = env, worlds
        self._check_mode()
        self.render_mode = worlds.render_mode
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)

    def set_opponent(self, opponent: Opponents) -> None:
        """Replace the opponent; see :meth:`PredPreyVectorEnv.set_opponent`."""
        self._worlds.set_opponent(opponent)

    def set_options(self, options: list[dict[str, Any]] | dict[str, Any] | None = None) -> None:
        """Set the options of the next reset only; they are those of :meth:`PredPreyVectorEnv.reset`.

        Rows share one environment, so a list with an item for each row must hold equal options. Raises
        :class:`ValueError` if the options differ, are unknown or cannot be used.
        """
        rows = list(options) if isinstance(options, Sequence) else [options]
        if isinstance(options, Sequence) and len(rows) != self.num_envs:
            raise ValueError(f"options must be a dict or one for each of {self.num_envs} rows, got {len(rows)}")
        first, *others = [read_reset_options(row, only_ours=True) for row in rows]
        if not all(_equal(first, other) for other in others):
            raise ValueError(f"options must be equal for all {self.num_envs} rows, which share one environment")
        self._worlds._read_options(first, self.num_envs)
        self._options = [copy.deepcopy(first)] * self.num_envs

    def reset(self) -> Observation:
        """Start all worlds with the seed and options that were set since the last call, and return the observations."""
        self._check_mode()
        observations, _ = self.env.reset(seed=self._seeds[0], options=self._options[0])
        self._reset_seeds()
        self._reset_options()
        return observations

    def step_async(self, actions: Actions) -> None:
        """Store the actions for :meth:`step_wait`."""
        self._actions = actions

    def step_wait(self) -> tuple[Observation, Rewards, RowMask, list[dict[str, Any]]]:
        """Play one time step of every world with the stored actions."""
        observations, rewards, terminated, truncated, told = self.env.step(self._actions)
        ended = terminated | truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for row in np.flatnonzero(ended):
            infos[row] = {
                "terminal_observation": told["final_obs"][row],
                "TimeLimit.truncated": bool(truncated[row]),
                "n_captured": int(told["final_info"]["n_captured"][row]),
            }
            if "opponent" in told["final_info"]:
                infos[row]["opponent"] = int(told["final_info"]["opponent"][row])
        return observations, rewards.astype(np.float32), ended, infos

    def close(self) -> None:
        """Close the environment."""
        self.env.close()

    def get_attr(self, attr_name: str, indices: RowIndices = None) -> list[Any]:
        """Return the environment's attribute, once for each of the rows."""
        value = self.render_mode if attr_name == "render_mode" else getattr(self._owner(attr_name), attr_name)
        return [value for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: RowIndices = None) -> None:
        """Set the environment's attribute.

        Raises :class:`ValueError` unless ``indices`` are all rows, which share the environment.
        """
        self._all_rows(indices)
        setattr(self._owner(attr_name), attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: RowIndices = None, **method_kwargs: Any
    ) -> list[Any]:
        """Call the environment's method once, and return its result for each row; for ``action_masks``, the row's mask.

        Raises :class:`ValueError` unless ``indices`` are all rows, which share the environment.
        """
        rows = self._all_rows(indices)
        if method_name == "action_masks":
            return [*self._worlds.action_masks()]
        return [getattr(self._owner(method_name), method_name)(*method_args, **method_kwargs)] * len(rows)

    def env_is_wrapped(self, wrapper_class: type, indices: RowIndices = None) -> list[bool]:  # noqa: ARG002
        """Return False for each row: a row has no wrapper of its own."""
        return [False for _ in self._get_indices(indices)]

    def get_images(self) -> Sequence[Picture | None]:
        """Return pictures of the first ``pictured_worlds`` worlds, see :meth:`PredPreyVectorEnv.render`."""
        pictures = self._worlds.render()
        if pictures is None:
            return [None] * self.num_envs
        n_agents = self.num_envs // self._worlds.n_worlds
        return pictures[: self._pictured_worlds * n_agents : n_agents]

    def _check_mode(self) -> None:
        mode = self._worlds.autoreset_mode
        if mode is not AutoresetMode.SAME_STEP:
            raise ValueError(
                f"make the environment with 'SameStep', as Stable-Baselines3 expects it, got {mode.value!r}"
            )

    def _owner(self, name: str) -> Any:
        """Return the object that has an attribute: the given environment, or the worlds inside its wrappers.

        Gymnasium's wrappers do not forward the attributes of the environment inside.
        """
        return self.env if hasattr(self.env, name) else self._worlds

    def _all_rows(self, indices: RowIndices) -> list[int]:
        rows = list(self._get_indices(indices))
        if sorted(rows) != list(range(self.num_envs)):
            raise ValueError(
                f"indices must be all {self.num_envs} rows, which share one environment, got {brief(rows)}"
            )
        return rows


def _equal(options: Options, other: Options) -> bool:
    return options.keys() == other.keys() and all(np.array_equal(options[name], other[name]) for name in options)
