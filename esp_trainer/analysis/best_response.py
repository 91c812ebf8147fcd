"""How much a team can be exploited: what fresh evolution finds against it once it stands still.

An approximate best response, as in the evaluation of game strategies (Lisy & Bowling 2017, local best response; Timbers
et al. 2022, approximate exploitability): a lower bound on what the best opponent could get.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from esp_trainer.analysis.cross_play import cross_play
from esp_trainer.analysis.history import History
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.types import Role, Teams
from predprey_env.policies.names import other_team

_EPISODES = 1000  # of each final measurement: a standard error of at most 0.016


@dataclass(frozen=True)
class BestResponse:
    """Fresh evolution against one side of a generation that was frozen."""

    role: Role
    """Who evolved."""
    generation: int
    """Of the frozen side."""
    before: float
    """Share of prey caught by (from) the frozen side when it met its contemporaries."""
    after: float
    """When it met the best response."""
    curve: np.ndarray
    """Share of prey caught by generation of the fresh evolution, on the starts that its champion was picked on,
    ``(n_generations,)``."""

    @property
    def gain(self) -> float:
        """What the best response takes beyond the contemporaries: at least about 0 if evolution found what they had."""
        return (self.after - self.before) * (1 if self.role == "predators" else -1)


def best_response(
    history: History,
    role: Role,
    evaluator: FusedEvaluator,
    *,
    generation: int = -1,
    n_generations: int = 100,
    seed: int = 0,
    watch: Callable[[], object] = lambda: None,
) -> BestResponse:
    """Freeze the opponents of ``role`` as they were in a generation, and evolve that role against them from nothing.

    The champion that does best on the run's held-out starts is measured again on others, as is the pair that the
    frozen side came from.

    Args:
        history: The run.
        role: Who evolves anew, by the run's own settings.
        evaluator: Of its world.
        generation: Whose opponents; by default the last.
        n_generations: Of the fresh evolution.
        seed: Of the fresh evolution; should not be that of the run.
        watch: Called after each of its generations.

    Raises:
        ValueError: The role follows a script in this run, so that there are no settings to evolve it by.
    """
    if role not in history.champions:
        raise ValueError(f"{role} must evolve in this run to answer anew, but follow a script")
    generation = range(len(history))[generation]
    other = other_team(role)
    config = history.config.replace(seed=seed, generations=n_generations, league="")  # one opponent alone
    fresh = History.evolve(config, evaluator, watch, {other: history.player(other, generation)})
    curve = fresh.curves["caught"]
    best = int(fresh.kept[curve[fresh.kept].argmax() if role == "predators" else curve[fresh.kept].argmin()])
    then = np.array([generation])
    frozen, contemporaries = history.entrants(other, then), history.entrants(role, then)

    def caught(responder: Teams) -> float:
        predators, prey = (responder, frozen) if role == "predators" else (frozen, responder)
        return float(cross_play(predators, prey, evaluator, n_episodes=_EPISODES, seed=seed).caught[0, 0])

    answer = fresh.entrants(role, np.array([best]))
    return BestResponse(role, generation, caught(contemporaries), caught(answer), curve)
