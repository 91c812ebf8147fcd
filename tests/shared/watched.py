"""A wrapper that sees what learners do not tell of."""

from __future__ import annotations

from typing import Any

from pettingzoo.utils import BaseParallelWrapper


class Watched(BaseParallelWrapper):
    """Counts the episodes that ended and the prey caught in them."""

    episodes = 0
    captures = 0

    def step(self, actions: dict[str, int]) -> tuple[dict[str, Any], ...]:
        transition = super().step(actions)
        infos = transition[-1]
        if infos and not self.agents:  # once an episode, however often a wrapper goes on
            self.episodes += 1
            self.captures += infos["predator_0"]["n_captured"]
        return transition
