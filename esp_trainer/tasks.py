"""The worlds in which teams are compared."""

from __future__ import annotations

from predprey_env.config import EnvConfig

TASKS: dict[str, EnvConfig] = {"3v2": EnvConfig(), "3v1": EnvConfig(n_prey=1)}
"""Name -> world: the paper's two worlds (section VI)."""
