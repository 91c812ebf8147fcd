"""Selection of the moment that shows a behaviour best, by the behaviour's detector."""

from __future__ import annotations

from dataclasses import dataclass

from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.behaviours.registry import BEHAVIOURS
from esp_trainer.arrays import Cells

BEFORE, AT_MOST, AFTER = 30, 30, 8  # number of steps to show before, during (at most) and after a moment


@dataclass(frozen=True)
class Moment:
    """A stretch of an episode in which a behaviour is seen."""

    behaviour: str
    step: int
    """First step of the stretch."""
    until: int
    """Last step of the stretch, which has no gap."""
    cells: Cells
    """Cells of all agents in the whole episode, int32 ``(n_steps + 1, n_agents, 2)``, predators first."""

    @property
    def shown(self) -> tuple[int, int]:
        """First and last step to show, with some steps before and after the stretch."""
        last = min(self.until, self.step + AT_MOST) + AFTER
        return max(0, self.step - BEFORE), min(last, len(self.cells) - 1)


def best_moment(behaviour: str, trace: Cells, paths: Paths) -> Moment | None:
    """Return the first stretch of a behaviour in the episode that shows it most often; None if none shows it.

    Args:
        behaviour: Name of the behaviour in the registry.
        trace: Cells, ``(n_episodes, n_rows, n_agents, 2)``, from :func:`~esp_trainer.analysis.watch.episodes`.
        paths: Paths of the same episodes.
    """
    rows = BEHAVIOURS[behaviour].rows(paths)
    if not rows.any():
        return None
    episode = int(rows.sum(axis=1).argmax())
    step = int(rows[episode].argmax())
    after = ~rows[episode, step:]
    until = step + int(after.argmax()) - 1 if after.any() else paths.n_rows - 1
    return Moment(behaviour, step, until, trace[episode, : int(paths.lengths[episode]) + 1])
