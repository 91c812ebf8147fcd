"""The worlds in which teams are compared."""

from __future__ import annotations

from predprey_env import tasks
from predprey_env.config import EnvConfig

WORLDS: dict[str, EnvConfig] = {name: task.world.replace(reward="terminal") for name, task in tasks.TASKS.items()}
"""Name -> world of a task of :data:`predprey_env.TASKS`. Rewards are terminal: teams are compared by their fitness."""
