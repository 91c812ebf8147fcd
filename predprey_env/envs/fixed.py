"""Read-only attributes: setting them would have no effect after an environment is made."""

from __future__ import annotations

from operator import attrgetter
from typing import Any

import numpy as np

from predprey_env.arrays import Picture
from predprey_env.config import EnvConfig, Rules
from predprey_env.policies.protocol import Policy


def read_only(name: str, way: str = "make another environment", kept: str = "") -> Any:
    """Return a read-only property whose value is stored as ``kept``, by default ``_name``.

    Setting it raises an :class:`AttributeError` that says what to do instead.
    """

    def refuse(env: object, value: object) -> None:  # noqa: ARG001
        raise AttributeError(f"{name} is read-only; {way}")

    return property(attrgetter(kept or f"_{name}"), refuse)


class Configured:
    """An environment made from a config. The config's fields are attributes; only ``max_cycles`` can be set."""

    config: EnvConfig = read_only("config")


for _field in EnvConfig.model_fields.keys() - {"max_cycles"}:
    setattr(Configured, _field, read_only(_field, f"make another environment with {_field}=...", f"config.{_field}"))
del _field


class Timed(Configured):
    """An environment that holds the world itself, and whose time limit can be changed."""

    _config: EnvConfig
    _rules: Rules

    @property
    def max_cycles(self) -> int:
        """Time limit in steps. A new limit set during an episode applies at once; if it has passed, the next step is
        the last.
        """
        return self.config.max_cycles

    @max_cycles.setter
    def max_cycles(self, steps: int) -> None:
        self._config = self._config.replace(max_cycles=steps)
        self._rules = self._config.rules


class Around(Configured):
    """An environment around an inner one, which holds the config, the time limit, the generator and the window."""

    _inner: Any

    @property
    def _config(self) -> EnvConfig:
        return self._inner.config

    @property
    def max_cycles(self) -> int:
        """Time limit in steps; see :attr:`predprey_env.PredPreyEnv.max_cycles`."""
        return self._inner.max_cycles

    @max_cycles.setter
    def max_cycles(self, steps: int) -> None:
        self._inner.max_cycles = steps

    @property
    def np_random(self) -> np.random.Generator:
        """The environment's generator."""
        return self._inner.np_random

    @property
    def np_random_seed(self) -> int:
        """Seed from which the generator was made."""
        return self._inner.np_random_seed

    def render(self) -> str | Picture | None:
        """Render the whole world; see :meth:`predprey_env.PredPreyEnv.render`."""
        return self._inner.render()

    def close(self) -> None:
        """Close the environment and its window."""
        self._inner.close()


class Opposed(Configured):
    """An environment that plays one team itself, with an opponent policy or a pool of them."""

    opponent: Policy | tuple[Policy, ...] = read_only("opponent", "call set_opponent(opponent)")
    """Policy that plays the other team, or all policies of a pool. A team view holds the copies that play, a vector
    environment the objects that were given."""

    _policies: tuple[Policy, ...]

    @property
    def _opponent(self) -> Policy | tuple[Policy, ...]:
        return self._policies[0] if len(self._policies) == 1 else self._policies
