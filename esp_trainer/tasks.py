"""The worlds in which teams are compared."""

from __future__ import annotations

from predprey_env.config import EnvConfig
from predprey_env.tasks import TASKS as NAMED

TASKS: dict[str, EnvConfig] = {name: task.world.replace(reward="terminal") for name, task in NAMED.items()}
"""Name -> world of a task of :data:`predprey_env.TASKS`. Rewards are terminal: teams are compared by their fitness."""
