"""The moment that shows a behaviour best, picked by its detector."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.behaviours.registry import BEHAVIOURS

BEFORE, AT_MOST, AFTER = 30, 30, 8  # steps that are shown before it, of it and after it


@dataclass(frozen=True)
class Moment:
    """When a behaviour is seen in an episode."""

    behaviour: str
    step: int
    """The first at which it is seen."""
    until: int
    """The last, without a break."""
    cells: np.ndarray
    """Everybody's cells in the whole episode, int32 ``(n_steps + 1, n_agents, 2)``, predators first."""

    @property
    def shown(self) -> tuple[int, int]:
        """The first and the last step of what one needs to see."""
        last = min(self.until, self.step + AT_MOST) + AFTER
        return max(0, self.step - BEFORE), min(last, len(self.cells) - 1)


def best_moment(behaviour: str, trace: np.ndarray, paths: Paths) -> Moment | None:
    """The moment of the episode in which a behaviour lasts longest; None if it is in none.

    Args:
        behaviour: A name in the registry.
        trace: Cells ``(n_episodes, n_rows, n_agents, 2)``, as :func:`~esp_trainer.analysis.watch.episodes` gives them.
        paths: The same as paths.
    """
    rows = BEHAVIOURS[behaviour].rows(paths)
    if not rows.any():
        return None
    episode = int(rows.sum(axis=1).argmax())
    step = int(rows[episode].argmax())
    after = ~rows[episode, step:]
    until = step + int(after.argmax()) - 1 if after.any() else paths.n_rows - 1
    return Moment(behaviour, step, until, trace[episode, : int(paths.lengths[episode]) + 1])
